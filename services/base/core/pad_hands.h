// A gamepad or a SpaceMouse as an operator's hands, on top of MouseHands: a deflection is a velocity of the tip,
// buttons close the jaw and press the pedals. Pure; states of the device and times are passed in. The page of the
// console has the same assignment (services/session/console/page/live.js).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "services/base/core/messages.h"
#include "services/base/core/mouse_hands.h"

namespace fulcrum {

/// Axes of a gamepad, right and up positive, and of a SpaceMouse (below): right, up, away from the operator, and turns
/// about these directions.
enum class PadAxis : std::uint8_t { kLeftX, kLeftY, kRightX, kRightY, kX, kY, kZ, kTurnX, kTurnY, kTurnZ };
inline constexpr std::size_t kPadAxes = 10;

/// Named by their place on a gamepad of Microsoft; the last two are those of a SpaceMouse.
enum class PadButton : std::uint8_t {
  kA,
  kB,
  kX,
  kY,
  kBack,
  kStart,
  kLeftStick,
  kRightStick,
  kLeftShoulder,
  kRightShoulder,
  kUp,
  kDown,
  kLeft,
  kRight,
  kLeftTrigger,
  kRightTrigger,
  kFirst,
  kSecond
};
inline constexpr std::size_t kPadButtons = 18;

/// In the cart file and in the list of inputs.
[[nodiscard]] const char* PadAxisName(PadAxis axis);
[[nodiscard]] const char* PadButtonName(PadButton button);

/// What a device reports at one moment.
struct PadState {
  std::int64_t device = 0;           ///< Differs between all devices since the start of the process.
  std::array<float, kPadAxes> axes;  ///< -1 to 1, by PadAxis.
  std::uint32_t buttons = 0;         ///< Bit per PadButton.

  PadState() { axes.fill(0); }
  [[nodiscard]] bool pressed(PadButton button) const { return (buttons >> static_cast<unsigned>(button) & 1u) != 0; }
};

enum class PadAction : std::uint8_t {
  kJaw,      ///< Closed while held.
  kJawLock,  ///< Jaw locked or unlocked.
  kTool0,
  kTool1,
  kTool2,
  kTool3,
  kCoag,
  kCut,
  kFine,    ///< A quarter of the motion while held.
  kSteady,  ///< Filter against tremor, on or off.
  kClutch,  ///< No motion while held.
  kTake,
  kRelease
};
inline constexpr std::size_t kPadActions = 13;
[[nodiscard]] const char* PadActionName(PadAction action);

/// An axis, perhaps inverted.
struct PadDirection {
  PadAxis axis;
  float sign = 1;  ///< 1 or -1.
  bool operator==(const PadDirection&) const = default;
};

/// Assignment of one kind of device. Default: a gamepad.
struct PadSettings {
  float speed_m_s = 0.06f;  ///< Of the tip, at full deflection.
  float dead_zone = 0.12f;  ///< Share of the deflection without effect.
  /// What moves the tip to the right and up in the picture and along the view; nothing: no motion that way.
  std::array<std::optional<PadDirection>, 3> motion{PadDirection{PadAxis::kLeftX}, PadDirection{PadAxis::kLeftY},
                                                    PadDirection{PadAxis::kRightY}};
  /// What turns the tool about its shaft, clockwise as seen from the handle; nothing: no turn.
  std::optional<PadDirection> turn = PadDirection{PadAxis::kRightX};
  float turn_rad_s = 1;  ///< At full deflection.
  /// By PadAction; nothing: no button does it.
  std::array<std::optional<PadButton>, kPadActions> buttons{
      PadButton::kA,   PadButton::kB,    PadButton::kLeftShoulder, PadButton::kRightShoulder,
      PadButton::kUp,  PadButton::kDown, PadButton::kLeftTrigger,  PadButton::kRightTrigger,
      PadButton::kX,   PadButton::kY,    PadButton::kLeftStick,    PadButton::kStart,
      PadButton::kBack};
  /// Force at the tip at which the rumble begins, and at which it is strongest [N].
  float rumble_from_N = 0.5f, rumble_full_N = 3.3f;

  [[nodiscard]] static PadSettings OfSpaceMouse();
};

/// Assignment of the inputs beside mouse and keyboard.
struct InputSettings {
  PadSettings gamepad;
  PadSettings space_mouse = PadSettings::OfSpaceMouse();
};

class PadHands {
 public:
  explicit PadHands(const PadSettings& settings) : settings_(settings) {}

  struct Outcome {
    bool changed = false;  ///< The intention of the hands has changed.
    bool take = false;     ///< The operator asks for the controls.
    bool release = false;  ///< The operator gives them back, or the device that operated is not there any more.
  };
  /// Applies the present state of the device to the hands. Call at a rate that the motion shall have.
  /// @param state null: no device. @param now_ns CLOCK_MONOTONIC [ns].
  Outcome Update(const PadState* state, std::int64_t now_ns, MouseHands* hands);

 private:
  void PressChanged(const PadState& state, MouseHands* hands, Outcome* outcome);

  PadSettings settings_;
  std::int64_t device_ = 0;      ///< 0: none.
  std::int64_t moved_ns_ = 0;    ///< Time up to which the motion is applied.
  std::uint32_t down_ = 0;       ///< Buttons that were down at the last update.
  std::uint32_t effective_ = 0;  ///< Actions (bit per PadAction) that are held since the controls were taken.
  bool operates_ = false;        ///< Has done something since the controls were taken.
};

/// Velocity of the tip for a deflection: to the right and up in the picture and along the view, each -1 to 1 [m/s].
/// Nothing within the dead zone, beyond it the cube of the rest, so that small motions are fine. The direction in the
/// picture is that of the stick.
[[nodiscard]] Vec3f PadVelocity(const PadSettings& settings, const Vec3f& deflection);

/// Rate of the turn about the shaft for a deflection of -1 to 1 [rad/s]; dead zone and curve are those of the motion.
[[nodiscard]] float PadTurn(const PadSettings& settings, float deflection);

/// Strength of the rumble, 0 to 1, for a force at the tip [N].
[[nodiscard]] float PadRumble(const PadSettings& settings, float force_N);

}  // namespace fulcrum
