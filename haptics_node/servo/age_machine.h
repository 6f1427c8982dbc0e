// How far the age of the contact model lets forces through. The same path serves start-up, a stall and a restart of
// physics: forces fade out smoothly, and come back only when models come steadily again, and softly.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"

namespace fulcrum::haptics {

inline constexpr std::int64_t kNormalAge_ns = 40'000'000;  ///< Up to here all is well.
inline constexpr std::int64_t kHoldAge_ns = 100'000'000;   ///< Up to here forces hold, with damping; beyond they fade.
inline constexpr double kFade_s = 0.300;                   ///< From all to nothing.
inline constexpr double kRise_s = 0.250;                   ///< From nothing to all.
inline constexpr int kFreshForReturn = 3;                  ///< Models in a row, each no older than kHoldAge_ns.
inline constexpr double kHoldDamping_Ns_m = 1.5;

class AgeMachine {
 public:
  /// A model that has passed the gate came in.
  void OnModel(std::int64_t t_s_ns, std::int64_t now_ns) noexcept;
  /// Once per tick. `t_s_ns`: time of the model in use, 0 when there is none.
  void Step(std::int64_t t_s_ns, std::int64_t now_ns, double dt) noexcept;

  [[nodiscard]] ServoState state() const noexcept { return state_; }
  /// Share of the force that is let through, 0 … 1, without corners in time.
  [[nodiscard]] double gain() const noexcept { return progress_ * progress_ * (3.0 - 2.0 * progress_); }
  /// Extra damping while the model is old [N s/m].
  [[nodiscard]] double damping() const noexcept { return old_ ? kHoldDamping_Ns_m * gain() : 0.0; }
  /// Fading or rising: the force may only creep.
  [[nodiscard]] bool creeping() const noexcept { return state_ != ServoState::kNormal && state_ != ServoState::kHold; }

 private:
  ServoState state_ = ServoState::kOff;
  double progress_ = 0;
  bool old_ = false;
  int fresh_ = 0;
  std::int64_t last_model_ns_ = 0;
};

}  // namespace fulcrum::haptics
