// A gamepad that exists in SDL only, for tests in the process that reads it.
#pragma once

#include <SDL.h>

#include <atomic>
#include <stdexcept>
#include <string>

namespace fulcrum::testing {

/// Keeps SDL's gamepads started. Two threads may not start them at once: make this before what reads gamepads on a
/// thread of its own.
class StartedPads {
 public:
  StartedPads() {
    SDL_SetHint(SDL_HINT_JOYSTICK_HIDAPI, "0");
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
    SDL_SetMainReady();
    if (SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) != 0) throw std::runtime_error(SDL_GetError());
  }
  ~StartedPads() { SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER); }
  StartedPads(const StartedPads&) = delete;
  StartedPads& operator=(const StartedPads&) = delete;
};

class VirtualPad {
 public:
  /// Plugs it in. SDL's joysticks must have been started, or are. @param known SDL knows its layout.
  explicit VirtualPad(bool known = true) {
    if (SDL_InitSubSystem(SDL_INIT_JOYSTICK) != 0) throw std::runtime_error(SDL_GetError());
    SDL_VirtualJoystickDesc description{};
    description.version = SDL_VIRTUAL_JOYSTICK_DESC_VERSION;
    description.type = static_cast<Uint16>(known ? SDL_JOYSTICK_TYPE_GAMECONTROLLER : SDL_JOYSTICK_TYPE_FLIGHT_STICK);
    description.naxes = SDL_CONTROLLER_AXIS_MAX;
    description.nbuttons = SDL_CONTROLLER_BUTTON_DPAD_RIGHT + 1;
    description.name = "Pad of a test";
    description.userdata = this;
    description.Rumble = [](void* self, Uint16 low, Uint16) {
      static_cast<VirtualPad*>(self)->rumble_.store(low);
      return 0;
    };
    index_ = SDL_JoystickAttachVirtualEx(&description);
    joystick_ = index_ < 0 ? nullptr : SDL_JoystickOpen(index_);
    if (joystick_ == nullptr) throw std::runtime_error(SDL_GetError());
    for (const int trigger : {SDL_CONTROLLER_AXIS_TRIGGERLEFT, SDL_CONTROLLER_AXIS_TRIGGERRIGHT}) Axis(trigger, -1);
  }
  ~VirtualPad() {
    Unplug();
    SDL_QuitSubSystem(SDL_INIT_JOYSTICK);
  }
  VirtualPad(const VirtualPad&) = delete;
  VirtualPad& operator=(const VirtualPad&) = delete;

  void Unplug() {
    if (joystick_ == nullptr) return;
    const SDL_JoystickID id = SDL_JoystickInstanceID(joystick_);
    SDL_JoystickClose(joystick_);
    joystick_ = nullptr;
    for (int i = 0; i < SDL_NumJoysticks(); ++i) {
      if (SDL_JoystickGetDeviceInstanceID(i) == id) SDL_JoystickDetachVirtual(i);
    }
  }
  /// @param value -1 to 1, down positive for a stick; -1 is a trigger that is let go.
  void Axis(int axis, float value) {
    SDL_JoystickSetVirtualAxis(joystick_, axis, static_cast<Sint16>(value * SDL_JOYSTICK_AXIS_MAX));
  }
  void Button(int button, bool down) { SDL_JoystickSetVirtualButton(joystick_, button, down ? 1 : 0); }
  /// Strength of the low motor, 0 to 65535.
  [[nodiscard]] int rumble() const { return rumble_.load(); }

 private:
  int index_ = -1;
  SDL_Joystick* joystick_ = nullptr;
  std::atomic<int> rumble_{0};
};

}  // namespace fulcrum::testing
