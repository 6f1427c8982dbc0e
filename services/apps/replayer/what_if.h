// What-if replay: the effect of changed parameters on a recorded session.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "services/apps/replayer/lock_step.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

/// Values of one quantity with the original and the changed parameters.
struct Pair {
  double before = 0, after = 0;
};

/// Effect of the changes. "Before" is the original scene, "after" the changed one, both replayed.
struct WhatIfResult {
  std::uint64_t ticks = 0;
  double session_s = 0, wall_s = 0;
  std::string missing;             ///< Reason of an early end; empty: none.
  double first_difference_s = -1;  ///< Session time of the first state that differs [s]; negative: none differs.
  NodeId first_node = NodeId::kPhysics;
  std::uint64_t frames = 0;    ///< Number of compared pairs of TissueFrames.
  double rms_position_mm = 0;  ///< Distance, rms over all vertices and frames.
  double max_position_mm = 0;
  double max_position_s = 0;  ///< Session time of the largest distance [s].
  Pair peak_tissue_force_N;   ///< Force of the tissue on a tool, from the contacts.
  double rms_tissue_force_N = 0;
  Pair peak_hand_force_N;  ///< Hand force at the tip; only when haptics is replayed.
  double rms_hand_force_N = 0;
  Pair cut_length_mm;  ///< Only when thermal is replayed.
  Pair highest_temperature_C;
  Pair injuries;   ///< Number of injuries of ureter and nerve.
  Pair burnt_mm2;  ///< Dead surface of all organs.
};

/// Replays the nodes twice, side by side: with `before` and with `after`. Nodes that are replayed together receive each
/// other's outputs; all other inputs are the recorded ones. A sample of another replayed node replaces the recorded one
/// with the same stamp. TopologyState, OpenCells and TearState, whose times differ between the replays, arrive
/// kCouplingDelay_s after they were sent. Throws like ReplayInLockStep.
WhatIfResult ReplayWhatIf(const LockStepSettings& settings, const SceneView& before, const SceneView& after,
                          const config::CartConfig& cart, const std::function<void(double)>& progress);

/// Time from the publication of the topology by thermal to the tick of physics that consumes it [s].
inline constexpr double kCouplingDelay_s = 0.002;

}  // namespace fulcrum::replay
