#include "render_node/offscreen/egl_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <GL/glext.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace fulcrum::render {
namespace {

[[noreturn]] void Fail(const char* step) {
  std::array<char, 256> text;
  std::snprintf(text.data(), text.size(),
                "no OpenGL off screen: %s failed (EGL error 0x%04x); install libegl-mesa0 and libgl1-mesa-dri", step,
                static_cast<unsigned>(eglGetError()));
  throw std::runtime_error(text.data());
}

/// nullptr where the EGL library does not have it.
template <typename Function>
Function Find(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

/// One display for each GPU; empty where there is none, or where EGL cannot list them.
std::vector<EGLDisplay> DisplaysOfGpus() {
  const auto list = Find<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  const auto text = Find<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
  const auto get_display = Find<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  std::array<EGLDeviceEXT, 16> devices{};
  EGLint count = 0;
  if (list == nullptr || text == nullptr || get_display == nullptr ||
      !list(static_cast<EGLint>(devices.size()), devices.data(), &count)) {
    return {};
  }
  std::vector<EGLDisplay> displays;
  for (EGLDeviceEXT device : std::span(devices).first(static_cast<std::size_t>(count))) {
    const char* const extensions = text(device, EGL_EXTENSIONS);
    const bool is_software = extensions != nullptr &&
                             std::string_view(extensions).find("EGL_MESA_device_software") != std::string_view::npos;
    EGLDisplay display = is_software ? EGL_NO_DISPLAY : get_display(EGL_PLATFORM_DEVICE_EXT, device, nullptr);
    if (display != EGL_NO_DISPLAY) displays.push_back(display);
  }
  return displays;
}

/// Mesa's display without a window system: software where there is no GPU.
EGLDisplay DisplayOfMesa() {
  const auto get_display = Find<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (get_display == nullptr) Fail("finding eglGetPlatformDisplayEXT");
  EGLDisplay display = get_display(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
  if (display == EGL_NO_DISPLAY) Fail("opening the surfaceless EGL platform");
  return display;
}

}  // namespace

int GlVersion() {
  GLint major = 0, minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  return 10 * major + minor;
}

EglContext::EglContext() {
  const std::vector<EGLDisplay> gpus = DisplaysOfGpus();
  // A GPU whose driver is missing or older than needed: the next one, and in the end software.
  if (std::ranges::any_of(gpus, [this](EGLDisplay gpu) { return Open(gpu) == nullptr && is_recent_; })) return;
  if (const char* const failed = Open(DisplayOfMesa()); failed != nullptr) Fail(failed);
  if (!is_recent_) throw std::runtime_error("OpenGL 4.3 is needed off screen; this is " + description_);
}

const char* EglContext::Open(void* display) {
  Close();
  display_ = display;
  if (!eglInitialize(display_, nullptr, nullptr)) return "eglInitialize";
  if (!eglBindAPI(EGL_OPENGL_API)) return "eglBindAPI(EGL_OPENGL_API)";
  const std::array<EGLint, 5> wanted{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (!eglChooseConfig(display_, wanted.data(), &config, 1, &count) || count == 0) return "eglChooseConfig";
  context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, nullptr);
  if (context_ == EGL_NO_CONTEXT) return "eglCreateContext";
  if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) return "eglMakeCurrent without a surface";
  description_ = std::string(reinterpret_cast<const char*>(glGetString(GL_RENDERER))) + ", OpenGL " +
                 reinterpret_cast<const char*>(glGetString(GL_VERSION));
  // glCopyImageSubData; Mesa's software renderer has had it for years.
  version_ = GlVersion();
  is_recent_ = version_ >= 43;
  Release();
  return nullptr;
}

// The display is shared by the whole process: it is not terminated here, so that two contexts can live side by side.
void EglContext::Close() noexcept {
  if (context_ == EGL_NO_CONTEXT) return;
  Release();
  eglDestroyContext(display_, context_);
  context_ = EGL_NO_CONTEXT;
}

EglContext::~EglContext() { Close(); }

void EglContext::MakeCurrent() {
  if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
    Fail("eglMakeCurrent without a surface");
  }
}

void EglContext::Release() noexcept { eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

}  // namespace fulcrum::render
