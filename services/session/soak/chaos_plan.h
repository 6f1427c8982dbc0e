// Plan of the injected faults ("blows") of a soak: time, kind and node of each. Pure: the same seed gives the same
// plan.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace fulcrum::soak {

enum class BlowKind {
  kKill,    ///< SIGKILL.
  kFreeze,  ///< SIGSTOP, and SIGCONT after some tenths of a second.
  kCrowd,   ///< A busy loop on each core for a second.
};
[[nodiscard]] const char* BlowName(BlowKind kind);

struct Blow {
  double time_s = 0;
  BlowKind kind = BlowKind::kKill;
  std::string node;     ///< Program of the node; empty for kCrowd.
  double length_s = 0;  ///< Duration of a freeze or crowd [s].
};

/// Blows from `begin_s` to `end_s`, `pause_s` apart on average. Nodes take turns, so that none is killed again before
/// it has run for long enough to count as healthy (supervisor/restart_policy.h).
[[nodiscard]] std::vector<Blow> PlanChaos(std::uint32_t seed, const std::vector<std::string>& nodes, double begin_s,
                                          double end_s, double pause_s);

}  // namespace fulcrum::soak
