#include "tests/support/force_judge.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace fulcrum::testing {
namespace {

constexpr double kLimit_N = 3.3;
constexpr double kSlew_N_per_tick = 0.4;
constexpr double kGone_s = 0.4;  // Time without a model after which the limit kGone_N applies.
constexpr double kGone_N = 0.1;  // Limit of the force without a model.
constexpr double kRise_N = 0.1;  // Largest rise within five ticks after a fade.
constexpr std::int64_t kTick_ns = 1'000'000, kWindow_ns = 5 * kTick_ns;
// ToolState contains the force at the proxy's tip. Converted to the hand, the lever has an error of the distance
// between proxy and tip relative to the shaft, millimetres to a decimetre, plus rounding.
constexpr double kLever = 1.02;
// Longest tick that the age machine takes into account.
constexpr std::int64_t kLongestTick_ns = 20'000'000;
constexpr std::int64_t kFadeAndSome_ns = 500'000'000;

}  // namespace

void ForceJudge::Add(const ToolState& state) {
  const ToolSample& tool = state.tools[tool_];
  const haptics::TrocarPose pose =
      haptics::PoseFromAttachPoint(trocar_, haptics::AttachPointForTip(trocar_, tool.p_WT.cast<double>()));
  const Vec3d f_A = haptics::ForceAtAttachPoint(pose, tool.f_W.cast<double>());
  const double force = f_A.norm();
  if (!(force <= kLever * kLimit_N)) Object(state, "force [N]", force);
  if (samples_ > 0) {
    const bool same_servo = state.stamp.epoch == last_.epoch;
    if (!same_servo) rise_.clear();
    // Ticks that a reader can interpolate are not published.
    const double between = static_cast<double>(state.stamp.stamp_ns - last_.stamp_ns) / kTick_ns;
    const double ticks = same_servo ? std::max(1.0, std::round(between)) : static_cast<double>(state.stamp.sequence);
    const double step = (f_A - (same_servo ? f_A_ : Vec3d::Zero())).norm();
    peak_step_ = std::max(peak_step_, step / ticks);
    if (step > kLever * kSlew_N_per_tick * ticks) Object(state, "step of the force [N]", step);
    if (!same_servo || state.stamp.stamp_ns - last_.stamp_ns > kLongestTick_ns) held_up_ns_ = state.stamp.stamp_ns;
  }
  const bool in_time = state.stamp.stamp_ns - held_up_ns_ > kFadeAndSome_ns;
  if (in_time && tool.model_age_s > kGone_s + 0.002 && force > kGone_N) Object(state, "force without a model", force);
  if (tool.state != ServoState::kRise) rise_.clear();
  if (tool.state == ServoState::kRise) {
    rise_.push_back({state.stamp.stamp_ns, force});
    while (rise_.size() > 1 && state.stamp.stamp_ns - rise_[1].stamp_ns >= kWindow_ns) rise_.pop_front();
    const double windows = std::max(1.0, static_cast<double>(state.stamp.stamp_ns - rise_[0].stamp_ns) / kWindow_ns);
    if (force - rise_[0].force > kLever * kRise_N * windows) {
      Object(state, "rise of the force in 5 ms [N]", (force - rise_[0].force) / windows);
    }
  }

  ++samples_;
  last_ = state.stamp;
  f_A_ = f_A;
  force_ = force;
  state_ = tool.state;
  least_ = std::min(least_, force);
  most_ = std::max(most_, force);
  peak_ = std::max(peak_, force);
}

void ForceJudge::Object(const ToolState& state, const char* what, double value) {
  if (!verdict_.empty()) return;
  std::ostringstream text;
  text << what << ' ' << value << " at tick " << state.stamp.sequence << ", state "
       << static_cast<int>(state.tools[tool_].state) << ", model " << 1e3f * state.tools[tool_].model_age_s
       << " ms old";
  verdict_ = text.str();
}

}  // namespace fulcrum::testing
