#include "physics_node/node/contact_rest.h"

#include <algorithm>

namespace fulcrum::physics {
namespace {

bool AtTheSamePlaces(const ToolState& a, const ToolState& b) {
  return std::equal(a.tools.begin(), a.tools.end(), b.tools.begin(), [](const ToolSample& x, const ToolSample& y) {
    return x.kind == y.kind && x.p_WT == y.p_WT && x.q_WT.coeffs() == y.q_WT.coeffs();
  });
}

}  // namespace

void ContactRest::Follow(const ToolState& before, const ToolState& after) {
  moves_ = !AtTheSamePlaces(before, last_) || !AtTheSamePlaces(before, after);
  fresh_ = before.stamp.sequence != last_.stamp.sequence || before.stamp.epoch != last_.stamp.epoch;
  last_ = before;
}

void ContactRest::Decide(bool calm, std::uint64_t tick_index) {
  calm_ticks_ = calm && !moves_ ? calm_ticks_ + 1 : 0;
  due_ = calm_ticks_ <= kRepeats || fresh_ || tick_index >= due_index_;
  if (due_) due_index_ = tick_index + kLongestSilence;
  fresh_ = false;
}

}  // namespace fulcrum::physics
