// An X server without a screen, for tests of the window.
#pragma once

#include <sys/types.h>

#include <string>

namespace fulcrum::testing {

/// Runs while the object exists and answers once it has been made. Its number is far from the usual ones: two servers
/// that do not see each other's locks may still meet on an abstract socket.
class VirtualScreen {
 public:
  /// @param size of the screen [pixels], such as "1280x800".
  explicit VirtualScreen(const std::string& size = "1280x800");
  ~VirtualScreen();
  VirtualScreen(const VirtualScreen&) = delete;
  VirtualScreen& operator=(const VirtualScreen&) = delete;
  /// ":N"; empty: the server did not start.
  [[nodiscard]] const std::string& display() const { return display_; }
  [[nodiscard]] bool installed() const { return installed_; }

 private:
  /// Waits until the server answers or has ended.
  void Await(int number);

  pid_t child_ = -1;
  bool installed_ = true;
  std::string display_;
};

}  // namespace fulcrum::testing
