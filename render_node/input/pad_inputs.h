// All inputs of the window beside mouse and keyboard: gamepads and SpaceMice as hands, and the rumble as a cue of
// force.
#pragma once

#include <cstdint>
#include <memory>

#include "render_node/input/gamepads.h"
#include "render_node/input/space_mouse.h"
#include "services/base/core/pad_hands.h"

namespace fulcrum::render {

/// Use by one thread.
class PadInputs {
 public:
  /// Without gamepads, with a line in the log, if SDL cannot start.
  explicit PadInputs(const InputSettings& settings);

  /// Reads the devices and applies the first gamepad and the first SpaceMouse to the hands.
  /// @param now_ns CLOCK_MONOTONIC [ns].
  PadHands::Outcome Update(std::int64_t now_ns, MouseHands* hands);
  /// @param force_N force at the tip of the operated tool; 0 while the controls are free.
  void Rumble(float force_N, std::int64_t now_ns);

  /// How long the caller may wait before the next Update() [ms]: SDL has no descriptor to wait for, and a stick that is
  /// held reports nothing. @param active the controls are taken. @param longest without a device.
  [[nodiscard]] int Wait_ms(bool active, int longest) const;
  /// Readable when a SpaceMouse reports; -1: there is none.
  [[nodiscard]] int descriptor() const { return mice_.descriptor(); }
  [[nodiscard]] bool has_gamepad() const { return gamepads_ && !gamepads_->pads().empty(); }

 private:
  InputSettings settings_;
  std::unique_ptr<Gamepads> gamepads_;
  SpaceMice mice_;
  PadHands gamepad_hands_, mouse_hands_;
  float rumble_ = 0;
  std::int64_t rumbled_ns_ = 0;
};

}  // namespace fulcrum::render
