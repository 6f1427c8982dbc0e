// What a person has at hand, as far as a window or a page can tell.
#pragma once

#include <string>

namespace fulcrum::testing {

class MouseAndKeyboard {
 public:
  virtual ~MouseAndKeyboard() = default;
  /// Moves the pointer by pixels, y down.
  virtual void Move(int x, int y) = 0;
  /// Moves the pointer with Control, which is along the view: positive away from the eye.
  virtual void MoveDeep(int pixels) {
    Press("Control_L", true);
    Move(0, -pixels);
    Press("Control_L", false);
  }
  /// @param key name of an X key symbol, such as "Return" or "f".
  virtual void Press(const std::string& key, bool down) = 0;
  void Click(const std::string& key) {
    Press(key, true);
    Press(key, false);
  }
};

}  // namespace fulcrum::testing
