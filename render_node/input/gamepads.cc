#include "render_node/input/gamepads.h"

#include <SDL.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace fulcrum::render {
namespace {

namespace fs = std::filesystem;

constexpr Uint32 kParts = SDL_INIT_GAMECONTROLLER;  // Starts joysticks and events as well.
/// A trigger counts as pressed from this share of its way on, and as let go below the other.
constexpr float kPressed = 0.5f, kLetGo = 0.4f;

constexpr std::array<std::pair<SDL_GameControllerButton, PadButton>, 14> kButtons{{
    {SDL_CONTROLLER_BUTTON_A, PadButton::kA},
    {SDL_CONTROLLER_BUTTON_B, PadButton::kB},
    {SDL_CONTROLLER_BUTTON_X, PadButton::kX},
    {SDL_CONTROLLER_BUTTON_Y, PadButton::kY},
    {SDL_CONTROLLER_BUTTON_BACK, PadButton::kBack},
    {SDL_CONTROLLER_BUTTON_START, PadButton::kStart},
    {SDL_CONTROLLER_BUTTON_LEFTSTICK, PadButton::kLeftStick},
    {SDL_CONTROLLER_BUTTON_RIGHTSTICK, PadButton::kRightStick},
    {SDL_CONTROLLER_BUTTON_LEFTSHOULDER, PadButton::kLeftShoulder},
    {SDL_CONTROLLER_BUTTON_RIGHTSHOULDER, PadButton::kRightShoulder},
    {SDL_CONTROLLER_BUTTON_DPAD_UP, PadButton::kUp},
    {SDL_CONTROLLER_BUTTON_DPAD_DOWN, PadButton::kDown},
    {SDL_CONTROLLER_BUTTON_DPAD_LEFT, PadButton::kLeft},
    {SDL_CONTROLLER_BUTTON_DPAD_RIGHT, PadButton::kRight},
}};

SDL_GameController* Of(void* handle) { return static_cast<SDL_GameController*>(handle); }

std::string TextOf(const char* text) { return text != nullptr ? text : ""; }

/// -1 to 1.
float Share(Sint16 value) { return std::max(-1.0f, static_cast<float>(value) / SDL_JOYSTICK_AXIS_MAX); }

void Read(SDL_GameController* pad, PadState* state) {
  const auto axis = [pad](SDL_GameControllerAxis which) { return Share(SDL_GameControllerGetAxis(pad, which)); };
  const auto set = [state](PadAxis which, float value) { state->axes[static_cast<std::size_t>(which)] = value; };
  set(PadAxis::kLeftX, axis(SDL_CONTROLLER_AXIS_LEFTX));
  set(PadAxis::kLeftY, -axis(SDL_CONTROLLER_AXIS_LEFTY));
  set(PadAxis::kRightX, axis(SDL_CONTROLLER_AXIS_RIGHTX));
  set(PadAxis::kRightY, -axis(SDL_CONTROLLER_AXIS_RIGHTY));
  std::uint32_t buttons = 0;
  const auto press = [&buttons](PadButton which) { buttons |= 1u << static_cast<unsigned>(which); };
  for (const auto& [button, which] : kButtons) {
    if (SDL_GameControllerGetButton(pad, button) != 0) press(which);
  }
  for (const auto& [trigger, which] : {std::pair{SDL_CONTROLLER_AXIS_TRIGGERLEFT, PadButton::kLeftTrigger},
                                       std::pair{SDL_CONTROLLER_AXIS_TRIGGERRIGHT, PadButton::kRightTrigger}}) {
    if (axis(trigger) > (state->pressed(which) ? kLetGo : kPressed)) press(which);
  }
  state->buttons = buttons;
}

}  // namespace

Gamepads::Gamepads() {
  // The window's keyboard focus is not SDL's business; signals are the node's; and the HIDAPI drivers would open
  // /dev/hidraw beside the kernel's own drivers, which know the same gamepads.
  for (const char* hint : {SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, SDL_HINT_NO_SIGNAL_HANDLERS}) {
    SDL_SetHint(hint, "1");
  }
  SDL_SetHint(SDL_HINT_JOYSTICK_HIDAPI, "0");
  SDL_SetMainReady();
  if (SDL_InitSubSystem(kParts) != 0) throw std::runtime_error(std::string("gamepads: ") + SDL_GetError());
  // States are read, so no events are needed; an unread queue would fill.
  SDL_JoystickEventState(SDL_IGNORE);
  SDL_GameControllerEventState(SDL_IGNORE);
}

Gamepads::~Gamepads() {
  for (void* handle : handles_) SDL_GameControllerClose(Of(handle));
  SDL_QuitSubSystem(kParts);
}

void Gamepads::Update() {
  SDL_JoystickUpdate();
  SDL_FlushEvents(SDL_FIRSTEVENT, SDL_LASTEVENT);
  for (std::size_t i = 0; i < pads_.size();) {
    if (SDL_GameControllerGetAttached(Of(handles_[i])) == SDL_TRUE) {
      ++i;
      continue;
    }
    SDL_GameControllerClose(Of(handles_[i]));
    handles_.erase(handles_.begin() + static_cast<std::ptrdiff_t>(i));
    pads_.erase(pads_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  Find();
  for (std::size_t i = 0; i < pads_.size(); ++i) Read(Of(handles_[i]), &pads_[i].state);
}

void Gamepads::Find() {
  for (int i = 0; i < SDL_NumJoysticks(); ++i) {
    // Instances count from 0 and are not used again.
    const std::int64_t id = std::int64_t{SDL_JoystickGetDeviceInstanceID(i)} + 1;
    const bool open = std::any_of(pads_.begin(), pads_.end(), [id](const Pad& pad) { return pad.state.device == id; });
    if (open || SDL_IsGameController(i) == SDL_FALSE) continue;
    SDL_GameController* const opened = SDL_GameControllerOpen(i);
    if (opened == nullptr) continue;  // Unplugged meanwhile.
    Pad pad;
    pad.device = {TextOf(SDL_GameControllerName(opened)), TextOf(SDL_GameControllerPath(opened)),
                  SDL_GameControllerGetVendor(opened), SDL_GameControllerGetProduct(opened)};
    pad.rumbles = SDL_GameControllerHasRumble(opened) == SDL_TRUE;
    pad.state.device = id;
    pads_.push_back(std::move(pad));
    handles_.push_back(opened);
  }
}

std::vector<InputDevice> Gamepads::unknown() const {
  std::vector<InputDevice> found;
  for (int i = 0; i < SDL_NumJoysticks(); ++i) {
    if (SDL_IsGameController(i) == SDL_TRUE) continue;
    found.push_back({TextOf(SDL_JoystickNameForIndex(i)), TextOf(SDL_JoystickPathForIndex(i)),
                     SDL_JoystickGetDeviceVendor(i), SDL_JoystickGetDeviceProduct(i)});
  }
  return found;
}

void Gamepads::Rumble(float strength) {
  if (handles_.empty() || !pads_.front().rumbles) return;
  // The low motor is the one that is felt as a push; the high one buzzes.
  const auto low = static_cast<Uint16>(std::lround(std::clamp(strength, 0.0f, 1.0f) * 65535.0f));
  (void)SDL_GameControllerRumble(Of(handles_.front()), low, 0, kRumble_ms);
}

std::vector<InputDevice> LockedJoysticks() {
  std::vector<InputDevice> locked;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/sys/class/input", error)) {
    if (!entry.path().filename().native().starts_with("js")) continue;
    InputDevice device;
    for (const auto& part : fs::directory_iterator(entry.path() / "device", error)) {
      const std::string name = part.path().filename();
      if (name.starts_with("event")) device.path = "/dev/input/" + name;
    }
    if (device.path.empty() || ::access(device.path.c_str(), R_OK | W_OK) == 0) continue;
    std::getline(std::ifstream(entry.path() / "device/name") >> std::ws, device.name);
    const auto id = [&entry](const char* file) {
      std::string digits;
      std::ifstream(entry.path() / "device/id" / file) >> digits;
      return static_cast<int>(std::strtol(digits.c_str(), nullptr, 16));
    };
    device.vendor = id("vendor");
    device.product = id("product");
    locked.push_back(std::move(device));
  }
  return locked;
}

}  // namespace fulcrum::render
