// Gamepads that are plugged in, by SDL2: only its joystick part, without video, windows or signal handlers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/base/core/pad_hands.h"

namespace fulcrum::render {

/// An input device as the list of inputs shows it.
struct InputDevice {
  std::string name;
  std::string path;  ///< "/dev/input/event7"; empty: unknown.
  int vendor = 0, product = 0;
};

/// Use by one thread at a time.
class Gamepads {
 public:
  struct Pad {
    InputDevice device;
    bool rumbles = false;
    PadState state;
  };

  /// Throws std::runtime_error if SDL cannot start.
  Gamepads();
  ~Gamepads();
  Gamepads(const Gamepads&) = delete;
  Gamepads& operator=(const Gamepads&) = delete;

  /// Reads what has arrived, without waiting: devices plugged in and out, axes, buttons.
  void Update();
  /// In the order in which they were plugged in; as of the last Update().
  [[nodiscard]] const std::vector<Pad>& pads() const { return pads_; }
  /// Joysticks whose layout SDL does not know: they operate nothing.
  [[nodiscard]] std::vector<InputDevice> unknown() const;
  /// Strength 0 to 1 of the first gamepad's rumble. Call again before kRumble_ms have passed.
  void Rumble(float strength);
  static constexpr int kRumble_ms = 300;

 private:
  void Find();

  std::vector<Pad> pads_;
  std::vector<void*> handles_;  ///< SDL_GameController of each of pads_.
};

/// Joysticks that the kernel has and that this user may not read.
[[nodiscard]] std::vector<InputDevice> LockedJoysticks();

}  // namespace fulcrum::render
