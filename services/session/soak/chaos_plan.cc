#include "services/session/soak/chaos_plan.h"

#include <algorithm>

namespace fulcrum::soak {
namespace {

// Number of kills and freezes in ten blows on average; the others are crowds.
constexpr int kKills = 5, kFreezes = 4;
constexpr double kShortestFreeze_s = 0.05, kLongestFreeze_s = 0.8;
constexpr double kCrowd_s = 1;

/// Uniform random number in [0, 1), the same on every platform, unlike std::uniform_real_distribution.
double Even(std::mt19937* random) { return static_cast<double>((*random)()) / 4294967296.0; }

}  // namespace

const char* BlowName(BlowKind kind) {
  switch (kind) {
    case BlowKind::kKill:
      return "kill";
    case BlowKind::kFreeze:
      return "freeze";
    case BlowKind::kCrowd:
      return "crowd";
  }
  return "?";
}

std::vector<Blow> PlanChaos(std::uint32_t seed, const std::vector<std::string>& nodes, double begin_s, double end_s,
                            double pause_s) {
  std::vector<Blow> blows;
  if (nodes.empty()) return blows;
  std::mt19937 random(seed);
  std::size_t turn = random();
  for (double time_s = begin_s; time_s < end_s; time_s += pause_s * (0.5 + Even(&random))) {
    Blow blow{time_s, BlowKind::kCrowd, "", kCrowd_s};
    const double die = 10 * Even(&random);
    if (die < kKills + kFreezes) {
      blow.node = nodes[turn++ % nodes.size()];
      blow.kind = die < kKills ? BlowKind::kKill : BlowKind::kFreeze;
      blow.length_s =
          blow.kind == BlowKind::kKill ? 0 : kShortestFreeze_s + (kLongestFreeze_s - kShortestFreeze_s) * Even(&random);
    }
    blows.push_back(blow);
  }
  return blows;
}

}  // namespace fulcrum::soak
