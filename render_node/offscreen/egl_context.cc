#include "render_node/offscreen/egl_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>
#include <GL/glext.h>

#include <array>
#include <cstdio>
#include <stdexcept>

namespace fulcrum::render {
namespace {

[[noreturn]] void Fail(const char* step) {
  std::array<char, 256> text;
  std::snprintf(text.data(), text.size(),
                "no OpenGL off screen: %s failed (EGL error 0x%04x); install libegl-mesa0 and libgl1-mesa-dri", step,
                static_cast<unsigned>(eglGetError()));
  throw std::runtime_error(text.data());
}

}  // namespace

EglContext::EglContext() {
  const auto get_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display == nullptr) {
    Fail("finding eglGetPlatformDisplayEXT");
  }
  display_ = get_display(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
  if (display_ == EGL_NO_DISPLAY) {
    Fail("opening the surfaceless EGL platform");
  }
  if (!eglInitialize(display_, nullptr, nullptr)) {
    Fail("eglInitialize");
  }
  if (!eglBindAPI(EGL_OPENGL_API)) {
    Fail("eglBindAPI(EGL_OPENGL_API)");
  }
  const std::array<EGLint, 5> wanted{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (!eglChooseConfig(display_, wanted.data(), &config, 1, &count) || count == 0) {
    Fail("eglChooseConfig");
  }
  context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, nullptr);
  if (context_ == EGL_NO_CONTEXT) {
    Fail("eglCreateContext");
  }
  MakeCurrent();
  description_ = std::string(reinterpret_cast<const char*>(glGetString(GL_RENDERER))) + ", OpenGL " +
                 reinterpret_cast<const char*>(glGetString(GL_VERSION));
  // glCopyImageSubData; Mesa's software renderer has had it for years.
  GLint major = 0, minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  Release();
  if (major < 4 || (major == 4 && minor < 3)) {
    throw std::runtime_error("OpenGL 4.3 is needed off screen; this is " + description_);
  }
}

// The display is shared by the whole process: it is not terminated here, so that two contexts can live side by side.
EglContext::~EglContext() {
  Release();
  eglDestroyContext(display_, context_);
}

void EglContext::MakeCurrent() {
  if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
    Fail("eglMakeCurrent without a surface");
  }
}

void EglContext::Release() noexcept { eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

}  // namespace fulcrum::render
