// The scripted operator: one interpolation for all readers of SceneView.script (simulated hand, simulated handle).
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>

#include "services/base/core/scene_view.h"

namespace fulcrum {

struct ScriptPoint {
  bool present = false;  ///< The script has keys for this tool.
  Vec3f p_W = Vec3f::Zero();
  float jaw_rad = 0;
  std::uint32_t pedals = 0;
  float power_W = 0;
  float roll_rad = 0;
};

/// Script of one tool at session time `time_s`. Place, jaw and roll follow a smoothstep from key to key, at rest at
/// each key; pedals and power apply from their key to the next. Before the first key (also before a session is known)
/// tool and jaw are at that key with pedals up; after the last key the state is that of the last key.
/// @param script keys sorted by tool, then time.
[[nodiscard]] inline ScriptPoint EvaluateScript(std::span<const ScriptKey> script, std::uint32_t tool, double time_s) {
  const auto first = std::lower_bound(script.begin(), script.end(), tool,
                                      [](const ScriptKey& key, std::uint32_t t) { return key.tool < t; });
  const auto end =
      std::upper_bound(first, script.end(), tool, [](std::uint32_t t, const ScriptKey& key) { return t < key.tool; });
  if (first == end) {
    return {};
  }
  // Of an hour that a hand performs there are 180,000 keys of a tool, and the servo asks each millisecond.
  const auto next = std::upper_bound(first, end, time_s, [](double t, const ScriptKey& key) { return t < key.time_s; });
  if (next == first) {
    return {true, first->p_W, first->jaw_rad, 0u, 0.0f, first->roll_rad};
  }
  const ScriptKey& a = *(next - 1);
  if (next == end) {
    return {true, a.p_W, a.jaw_rad, a.pedals, a.power_W, a.roll_rad};
  }
  const auto u = static_cast<float>((time_s - a.time_s) / (next->time_s - a.time_s));
  const float w = u * u * (3.0f - 2.0f * u);
  const auto between = [w](const auto& from, const auto& to) { return from + w * (to - from); };
  return {true,      a.p_W + w * (next->p_W - a.p_W),    between(a.jaw_rad, next->jaw_rad), a.pedals,
          a.power_W, between(a.roll_rad, next->roll_rad)};
}

/// Angle of a scripted jaw below which it is closed [rad].
inline constexpr float kJawCloses_rad = 0.2f;

/// Session time of the last key at which the tool's jaw is closed; infinite if it never is. Where a person operates the
/// other tools, an assistant does not let go by the clock: its script stands still from then on.
[[nodiscard]] inline double LastHoldOf(std::span<const ScriptKey> script, std::uint32_t tool) {
  double last_s = std::numeric_limits<double>::infinity();
  for (const ScriptKey& key : script) {
    if (key.tool == tool && key.jaw_rad < kJawCloses_rad) last_s = static_cast<double>(key.time_s);
  }
  return last_s;
}

}  // namespace fulcrum
