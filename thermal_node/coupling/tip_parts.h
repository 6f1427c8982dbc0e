// The samples of a frame as parts of its time step.
#pragma once

#include <algorithm>
#include <span>

#include "thermal_node/coupling/tip_tracker.h"

namespace fulcrum::thermal {

/// Below this excess temperature the metal's heat exchange with tissue is neglected [K].
inline constexpr float kHookWarm = 2.0f;

/// Time without samples after which the figures of the generator are 0 [s]: ten missed samples of physics_node.
inline constexpr float kSilent_s = 0.1f;

[[nodiscard]] inline float DurationOf(const TipInput& tip, float dt_s) {
  return tip.duration_s > 0.0f ? tip.duration_s : dt_s;
}
[[nodiscard]] inline float Duration(std::span<const TipInput> tips, float dt_s) {
  float sum = 0;
  for (const TipInput& tip : tips) sum += DurationOf(tip, dt_s);
  return sum;
}

/// Whether a sample heats or cools tissue by a metal at `hook_theta` above body temperature [K]: metal at the
/// temperature of the tissue exchanges no heat with it.
[[nodiscard]] inline bool Acts(const TipInput& tip, float hook_theta) {
  return tip.active || (tip.touching && std::abs(hook_theta) > kHookWarm);
}

/// Calls visit(tip, path, length_s) for what lies between the fractions `from` and `to` of the samples' total duration.
template <class Visit>
void ForPartsOf(std::span<const TipInput> tips, float dt_s, float from, float to, const Visit& visit) {
  const float all_s = Duration(tips, dt_s), from_s = from * all_s, to_s = to * all_s;
  float begin_s = 0;
  for (const TipInput& tip : tips) {
    const float length_s = DurationOf(tip, dt_s), end_s = begin_s + length_s;
    const float a = (std::max(from_s, begin_s) - begin_s) / length_s, b = (std::min(to_s, end_s) - begin_s) / length_s;
    begin_s = end_s;
    if (b > a) visit(tip, PartOf(tip.path, a, b), (b - a) * length_s);
  }
}

}  // namespace fulcrum::thermal
