// The same session with a parameter changed: what would have been?
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "services/apps/replayer/lock_step.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

/// Two numbers of the same thing.
struct Pair {
  double before = 0, after = 0;
};

/// What a changed parameter does. "Before" is the scene as it was, "after" the changed one, both replayed.
struct WhatIfResult {
  std::uint64_t ticks = 0;
  double session_s = 0, wall_s = 0;
  std::string missing;             ///< Why it ended early; empty: it did not.
  double first_difference_s = -1;  ///< Session time of the first state that differs; negative: none does.
  NodeId first_node = NodeId::kPhysics;
  std::uint64_t frames = 0;    ///< Pairs of TissueFrames compared.
  double rms_position_mm = 0;  ///< Over all vertices and frames.
  double max_position_mm = 0;
  double max_position_s = 0;  ///< Session time of that.
  Pair peak_tissue_force_N;   ///< Of the tissue on a tool, from the contacts.
  double rms_tissue_force_N = 0;
  Pair peak_hand_force_N;  ///< Sent to the hand; haptics replayed only.
  double rms_hand_force_N = 0;
  Pair cut_length_mm;  ///< Thermal replayed only.
  Pair highest_temperature_C;
  Pair injuries;  ///< Of ureter and nerve.
};

/// Replays the nodes twice, side by side: with `before` and with `after`. Nodes that are replayed together feed each
/// other; the rest of their inputs are the recorded ones. A sample of another replayed node stands in for the recorded
/// one of the same moment; TopologyState, OpenCells and TearState, which have moments of their own, come
/// kCouplingDelay_s after it was sent. Throws as ReplayInLockStep.
WhatIfResult ReplayWhatIf(const LockStepSettings& settings, const SceneView& before, const SceneView& after,
                          const config::CartConfig& cart, const std::function<void(double)>& progress);

/// From what thermal sends of its topology to the tick of physics that finds it [s].
inline constexpr double kCouplingDelay_s = 0.002;

}  // namespace fulcrum::replay
