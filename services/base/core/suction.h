// The suction and irrigation tube (ToolKind::kSuction): what it does, from the angle of its handle, and how much flows.
// Every input closes a handle (mouse, key, pad, page, button of a device, script, potentiometer), not all can half
// close one, so time tells the two pistons of the valve apart: a squeeze aspirates while it lasts, a second squeeze
// that begins soon after the first irrigates while it lasts.
#pragma once

#include <cstdint>

namespace fulcrum {

enum class TubeFlow : std::uint8_t { kNone, kAspirates, kIrrigates };

/// Aspirated liquid and gas: assumed, of a tube of 5 mm.
inline constexpr float kAspiration_m3_s = 2e-3f / 60;
inline constexpr float kAspiratedGas_m3_s = 20e-3f / 60;

/// The valve of one tube, shut until the handle has been let go once: a process that starts during a squeeze does not
/// know which of the two it is. Pure; a function of the handle's samples.
class TrumpetValve {
 public:
  static constexpr float kSqueezed_rad = 0.20f;  ///< Below it a handle is squeezed,
  static constexpr float kLetGo_rad = 0.35f;     ///< from here on let go; between the two it is what it was.
  static constexpr double kTwice_s = 0.6;        ///< A squeeze that begins so soon after the last one irrigates.

  /// Takes a sample. @param time_s of any clock; where it goes back, the squeezes before are forgotten [s].
  TubeFlow Step(double time_s, float jaw_rad) {
    if (jaw_rad >= kLetGo_rad) {
      let_go_ = true;
      flow_ = TubeFlow::kNone;
    } else if (let_go_ && flow_ == TubeFlow::kNone && jaw_rad < kSqueezed_rad) {
      const double since_s = time_s - squeezed_s_;
      flow_ = since_s >= 0 && since_s < kTwice_s ? TubeFlow::kIrrigates : TubeFlow::kAspirates;
      squeezed_s_ = time_s;
    }
    return flow_;
  }
  /// The handle is not there: the valve is shut.
  void Shut() { flow_ = TubeFlow::kNone; }
  [[nodiscard]] TubeFlow flow() const { return flow_; }

 private:
  TubeFlow flow_ = TubeFlow::kNone;
  bool let_go_ = false;
  double squeezed_s_ = -1e9;  // Begin of the last squeeze.
};

}  // namespace fulcrum
