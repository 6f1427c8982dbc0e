// A person at a window, as far as the X server can tell: moves the pointer and presses keys.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace fulcrum::testing {

class XClient {
 public:
  /// Throws std::runtime_error if the display does not answer.
  explicit XClient(const std::string& display);
  ~XClient();
  XClient(const XClient&) = delete;
  XClient& operator=(const XClient&) = delete;

  /// Looks for the window of that name; false: there is none yet.
  bool FindWindow(const std::string& name);
  /// Moves the pointer by pixels, y down.
  void Move(int x, int y);
  /// Pixels of a square of the window, which must be visible and contain it; in the format of the display.
  [[nodiscard]] std::vector<unsigned char> Pixels(int x, int y, int size);
  /// @param key name of an X key symbol, such as "Return" or "f".
  void Press(const std::string& key, bool down);
  void Click(const std::string& key) {
    Press(key, true);
    Press(key, false);
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::testing
