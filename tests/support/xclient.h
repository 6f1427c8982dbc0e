// A person at a window, as far as the X server can tell: moves the pointer and presses keys.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/mouse_and_keyboard.h"

namespace fulcrum::testing {

/// Pixels of a window: blue, green, red and an unused byte each, row by row from the top.
struct WindowPicture {
  int width = 0, height = 0;
  std::vector<unsigned char> bgrx;
};

class XClient final : public MouseAndKeyboard {
 public:
  /// Throws std::runtime_error if the display does not answer.
  explicit XClient(const std::string& display);
  ~XClient() override;
  XClient(const XClient&) = delete;
  XClient& operator=(const XClient&) = delete;

  /// Looks for the window of that name; false: there is none yet.
  bool FindWindow(const std::string& name);
  void Move(int x, int y) override;
  /// Pixels of a square of the window, which must be visible and contain it; in the format of the display.
  [[nodiscard]] std::vector<unsigned char> Pixels(int x, int y, int size);
  /// Asks for another size of the window [pixels], as a user who drags its border, in the upper left corner of the
  /// screen.
  void Resize(int width, int height);
  /// All of the window, which must be visible.
  [[nodiscard]] WindowPicture Whole();
  void Press(const std::string& key, bool down) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// An empty window of 640 x 360 pixels, as long as the object exists.
class BareWindow {
 public:
  /// Throws std::runtime_error if the display does not answer.
  explicit BareWindow(const std::string& display);
  ~BareWindow();
  BareWindow(const BareWindow&) = delete;
  BareWindow& operator=(const BareWindow&) = delete;
  [[nodiscard]] unsigned long id() const { return id_; }

 private:
  void* display_;
  unsigned long id_ = 0;
};

}  // namespace fulcrum::testing
