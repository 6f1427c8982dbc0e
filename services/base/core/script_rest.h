// Until when a scripted operator does nothing.
#pragma once

#include <algorithm>
#include <limits>
#include <span>

#include "services/base/core/scene_view.h"

namespace fulcrum {

/// Session time until which EvaluateScript of the tool gives what it gives at `time_s` [s]: infinite after the last
/// change; not later than `time_s` while something changes.
/// @param script keys sorted by tool, then time.
[[nodiscard]] inline double ScriptRestsUntil(std::span<const ScriptKey> script, std::uint32_t tool, double time_s) {
  const auto first = std::lower_bound(script.begin(), script.end(), tool,
                                      [](const ScriptKey& key, std::uint32_t t) { return key.tool < t; });
  const auto end =
      std::upper_bound(first, script.end(), tool, [](std::uint32_t t, const ScriptKey& key) { return t < key.tool; });
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (first == end) return kNever;
  auto next = std::upper_bound(first, end, time_s, [](double t, const ScriptKey& key) { return t < key.time_s; });
  if (next == first) {
    // Pedals and power begin at the first key.
    if (first->pedals != 0 || first->power_W != 0) return static_cast<double>(first->time_s);
    ++next;
  }
  for (; next != end; ++next) {
    const ScriptKey& last = *(next - 1);
    const bool moves = next->p_W != last.p_W || next->jaw_rad != last.jaw_rad || next->roll_rad != last.roll_rad;
    if (moves) return static_cast<double>(last.time_s);
    if (next->pedals != last.pedals || next->power_W != last.power_W) return static_cast<double>(next->time_s);
  }
  return kNever;
}

}  // namespace fulcrum
