#include "haptics_node/servo/age_machine.h"

#include <algorithm>

namespace fulcrum::haptics {

void AgeMachine::OnModel(std::int64_t t_s_ns, std::int64_t now_ns) noexcept {
  const bool fresh = now_ns - t_s_ns <= kHoldAge_ns;
  const bool in_a_row = now_ns - last_model_ns_ <= kHoldAge_ns;
  fresh_ = !fresh ? 0 : in_a_row ? fresh_ + 1 : 1;
  last_model_ns_ = now_ns;
}

void AgeMachine::Step(std::int64_t t_s_ns, bool contacts, std::int64_t now_ns, double dt) noexcept {
  const std::int64_t age = now_ns - t_s_ns;
  const bool lost = t_s_ns == 0 || age > kHoldAge_ns;
  old_ = !lost && contacts && age > kNormalAge_ns;
  if (lost && state_ != ServoState::kOff && state_ != ServoState::kFade) {
    state_ = ServoState::kFade;
    fresh_ = 0;  // Earlier models do not count.
  } else if (!lost && creeping() && state_ != ServoState::kRise && fresh_ >= kFreshForReturn) {
    state_ = ServoState::kRise;
  }
  switch (state_) {
    case ServoState::kFade:
      progress_ = std::max(0.0, progress_ - dt / kFade_s);
      if (progress_ == 0.0) state_ = ServoState::kOff;
      break;
    case ServoState::kRise:
      progress_ = std::min(1.0, progress_ + dt / kRise_s);
      if (progress_ == 1.0) state_ = ServoState::kNormal;
      break;
    case ServoState::kNormal:
    case ServoState::kHold:
      state_ = old_ ? ServoState::kHold : ServoState::kNormal;
      break;
    case ServoState::kOff:
      break;
  }
}

}  // namespace fulcrum::haptics
