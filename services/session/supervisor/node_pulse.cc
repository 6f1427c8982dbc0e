#include "services/session/supervisor/node_pulse.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/tick.h"

namespace fulcrum::supervisor {
namespace {

// Longest time to the first Health, in which a node maps the scene and builds its solver.
constexpr std::int64_t kLongestStart_ns = 60 * kSecond_ns;
// A separate thread of each node sends Health ten times a second: a node without Health for this long hangs. A node
// that was only suspended goes on with its state, which a restart would lose in part.
constexpr std::int64_t kLongestStill_ns = 5 * kSecond_ns;
// With a spare a restart takes 0.1 to 0.7 s, so a picture that hangs is back within 2 s. The longest picture of
// software OpenGL beside six busy loops on two cores took 0.23 s. A little more than kLongestGap_s (verdict.h), so that
// the fault is found before the node is killed.
constexpr std::int64_t kLongestStillWithSpare_ns = 5 * kSecond_ns / 4;
// ... and of a node with a low rate, whose ticks are seldom.
constexpr std::int64_t kLongestStill_periods = 3;
// A step of the recorder lasts as long as the disk stands still, or writes a dump; what it receives meanwhile waits.
constexpr std::int64_t kLongestStepOnDisk_ns = 30 * kSecond_ns;

}  // namespace

void NodePulse::Start(std::int64_t now_ns) {
  *this = NodePulse();
  started_ns_ = now_ns;
}

void NodePulse::Add(const Health& health, std::int64_t now_ns) {
  const bool steps = health.state == HealthState::kRunning || health.state == HealthState::kDegraded;
  if (!steps || !steps_ || health.ticks != ticks_) progress_ns_ = now_ns;
  health_ns_ = now_ns;
  steps_ = steps;
  ticks_ = health.ticks;
  has_reported_ = true;
  waits_for_disk_ = health.node == NodeId::kRecorder;
  period_ns_ = health.rate_asked_Hz > 0 ? std::llround(1e9 / static_cast<double>(health.rate_asked_Hz)) : 0;
}

void NodePulse::ResetTimeouts(std::int64_t until_ns) {
  started_ns_ = health_ns_ = progress_ns_ = timeouts_reset_ns_ = until_ns;
}

const char* NodePulse::Complaint(bool has_spare, std::int64_t now_ns) const {
  constexpr const char* kSilent = "sent no Health for too long and was killed";
  if (now_ns < timeouts_reset_ns_) return nullptr;  // Health that was waiting may have come meanwhile, and no more.
  if (!has_reported_) return now_ns - started_ns_ > kLongestStart_ns ? kSilent : nullptr;
  // The first step is part of the start, and a spare that was used is not made again in this time.
  const bool replaceable = has_spare && steps_ && ticks_ > 0;
  const std::int64_t longest =
      std::max(replaceable ? kLongestStillWithSpare_ns : kLongestStill_ns, kLongestStill_periods * period_ns_);
  if (now_ns - std::max(health_ns_, timeouts_reset_ns_) > longest) return kSilent;
  const std::int64_t longest_step = waits_for_disk_ ? kLongestStepOnDisk_ns : longest;
  if (steps_ && now_ns - std::max(progress_ns_, timeouts_reset_ns_) > longest_step)
    return "was stuck in a step for too long and was killed";
  return nullptr;
}

}  // namespace fulcrum::supervisor
