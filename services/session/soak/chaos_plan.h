// Who is hurt when, and how. Pure: the same seed gives the same blows.
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
  kCrowd,   ///< A busy loop for each core for a second.
};
[[nodiscard]] const char* BlowName(BlowKind kind);

struct Blow {
  double time_s = 0;
  BlowKind kind = BlowKind::kKill;
  std::string node;     ///< Its program; empty for kCrowd.
  double length_s = 0;  ///< Of freeze and crowd.
};

/// Blows from `begin_s` to `end_s`, `pause_s` apart on the mean. Each node in turn, so that none is killed again before
/// it has lived for long enough to count as healthy (supervisor/restart_policy.h).
[[nodiscard]] std::vector<Blow> PlanChaos(std::uint32_t seed, const std::vector<std::string>& nodes, double begin_s,
                                          double end_s, double pause_s);

}  // namespace fulcrum::soak
