// Share of the force that is rendered, as a function of the contact model's age. Start-up, a stall and a restart of
// physics_node are treated alike: forces fade out smoothly, and rise smoothly again once models arrive regularly.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"

namespace fulcrum::haptics {

inline constexpr std::int64_t kNormalAge_ns = 40'000'000;  ///< Up to this age forces are rendered unchanged.
/// Up to this age forces are rendered with extra damping; beyond they fade.
inline constexpr std::int64_t kHoldAge_ns = 100'000'000;
inline constexpr double kFade_s = 0.300;   ///< Duration of the fade from full force to 0.
inline constexpr double kRise_s = 0.250;   ///< Duration of the rise from 0 to full force.
inline constexpr int kFreshForReturn = 3;  ///< Consecutive models, each no older than kHoldAge_ns, that start a rise.
inline constexpr double kHoldDamping_Ns_m = 1.5;  ///< Extra damping beyond kNormalAge_ns, at full gain.

class AgeMachine {
 public:
  /// Registers a model that has passed the gate.
  void OnModel(std::int64_t t_s_ns, std::int64_t now_ns) noexcept;
  /// Once per tick. `t_s_ns`: time of the model in use, 0 when there is none. `contacts`: it has some; one without
  /// holds no force, and comes each 40 ms only while nothing moves.
  void Step(std::int64_t t_s_ns, bool contacts, std::int64_t now_ns, double dt) noexcept;

  [[nodiscard]] ServoState state() const noexcept { return state_; }
  /// Share of the force that is rendered, 0 … 1; its time derivative is continuous.
  [[nodiscard]] double gain() const noexcept { return progress_ * progress_ * (3.0 - 2.0 * progress_); }
  /// Extra damping while the model is old [N s/m].
  [[nodiscard]] double damping() const noexcept { return old_ ? kHoldDamping_Ns_m * gain() : 0.0; }
  /// True while fading or rising: the rate limit is then kCreepSlew_N_per_ms.
  [[nodiscard]] bool creeping() const noexcept { return state_ != ServoState::kNormal && state_ != ServoState::kHold; }

 private:
  ServoState state_ = ServoState::kOff;
  double progress_ = 0;
  bool old_ = false;
  int fresh_ = 0;
  std::int64_t last_model_ns_ = 0;
};

}  // namespace fulcrum::haptics
