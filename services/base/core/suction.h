// The suction and irrigation tube (ToolKind::kSuction): what it does, from the angle of its handle, and how much flows.
// Every input closes a handle (mouse, key, pad, page, button of a device, script, potentiometer), not all can half
// close one, so time tells the two pistons of the valve apart: a squeeze aspirates while it lasts, a second squeeze
// that begins soon after the first irrigates while it lasts.
#pragma once

#include <cstdint>

namespace fulcrum {

enum class TubeFlow : std::uint8_t { kNone, kAspirates, kIrrigates };

/// "Irrigation systems with a minimal flow rate of 1 L/min are essential" in laparoscopic colorectal surgery
/// (78stepshealth.us/laparoscopic-surgery/irrigationsuction.html). Aspired liquid and gas: assumed, of a tube of 5 mm.
inline constexpr float kIrrigation_m3_s = 1e-3f / 60;
inline constexpr float kAspiration_m3_s = 2e-3f / 60;
inline constexpr float kAspiredGas_m3_s = 20e-3f / 60;

/// The valve of one tube. Pure; a function of the handle's samples.
class TrumpetValve {
 public:
  static constexpr float kSqueezed_rad = 0.20f;  ///< Below it a handle is squeezed,
  static constexpr float kLetGo_rad = 0.35f;     ///< from here on let go; between the two it is what it was.
  static constexpr double kTwice_s = 0.6;        ///< A squeeze that begins so soon after the last one irrigates.

  /// Takes a sample. @param time_s of any clock, not decreasing [s].
  TubeFlow Step(double time_s, float jaw_rad) {
    if (flow_ != TubeFlow::kNone && jaw_rad >= kLetGo_rad) {
      flow_ = TubeFlow::kNone;
    } else if (flow_ == TubeFlow::kNone && jaw_rad < kSqueezed_rad) {
      flow_ = time_s - squeezed_s_ < kTwice_s ? TubeFlow::kIrrigates : TubeFlow::kAspirates;
      squeezed_s_ = time_s;
    }
    return flow_;
  }
  /// The handle is not there: the valve is shut.
  void Shut() { flow_ = TubeFlow::kNone; }
  [[nodiscard]] TubeFlow flow() const { return flow_; }

 private:
  TubeFlow flow_ = TubeFlow::kNone;
  double squeezed_s_ = -1e9;  // Begin of the last squeeze.
};

}  // namespace fulcrum
