// An OpenGL context without a window system: EGL on a GPU (EGL_EXT_platform_device), else on Mesa's surfaceless
// platform. Works on software GL, in a container, with no X server and no GPU.
#pragma once

#include <string>

namespace fulcrum::render {

/// Version of the current OpenGL context: 43 is 4.3.
[[nodiscard]] int GlVersion();

class EglContext {
 public:
  /// Makes a compatibility-profile OpenGL context. Throws std::runtime_error with one line that says which step failed
  /// and what to install.
  EglContext();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Makes the context current on the calling thread, without a surface. Throws std::runtime_error if it is current on
  /// another thread.
  void MakeCurrent();
  /// Releases the context, so that another thread can make it current.
  void Release() noexcept;

  /// GL_RENDERER and GL_VERSION, for the log.
  [[nodiscard]] const std::string& description() const { return description_; }
  /// As GlVersion().
  [[nodiscard]] int version() const { return version_; }

 private:
  /// Makes the context; nullptr, or the step that failed.
  const char* Open(void* display);
  void Close() noexcept;

  void* display_ = nullptr;
  void* context_ = nullptr;
  std::string description_;
  int version_ = 0;
  bool is_recent_ = false;  ///< OpenGL 4.3.
};

}  // namespace fulcrum::render
