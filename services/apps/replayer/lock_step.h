// Lock-step replay: nodes compute the ticks of a recording again, and their states are compared with the recorded ones.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

struct LockStepSettings {
  std::filesystem::path recording;
  std::vector<NodeId> nodes;     ///< Nodes to replay: physics, thermal, haptics.
  std::filesystem::path folder;  ///< Folder for checkpoints of the replayed nodes; must exist.
  double rate = 0;               ///< Speed as a multiple of real time; 0: as fast as possible.
  int physics_threads = 1;       ///< Threads per step of physics; the states do not depend on it.
  double until_s = -1;           ///< Session time of the end [s]; negative: the end of the recording.
  bool go_on = false;            ///< Continue after a state that differs.
  bool figures = false;          ///< Collect all figures of Health, also those of the force on tools.
};

/// The first tick after which a node's state differs from the recorded one.
struct Departure {
  std::uint64_t tick = 0;
  double session_time_s = 0;
  std::int64_t stamp_ns = 0;
  std::uint64_t epoch = 0;
  std::uint64_t recorded_hash = 0, replayed_hash = 0;
  std::string
      field;  ///< First published difference: topic, field, index and both values; or a note that there is none.
};

/// A figure of a node's Health, sampled at the rate of Health.
struct HealthFigure {
  double last = 0, least = 0, most = 0;
};

struct NodeResult {
  NodeId node = NodeId::kPhysics;
  std::uint64_t ticks = 0;                  ///< Computed ticks.
  std::uint64_t compared = 0;               ///< Ticks whose state hash is recorded.
  std::uint64_t starts = 0;                 ///< 1 plus the restarts of the node.
  double session_time_s = 0;                ///< Session time of its last tick [s].
  double busy_s = 0;                        ///< Time spent computing [s].
  double step_p50_ms = 0, step_p99_ms = 0;  ///< Of the ticks [ms].
  std::uint64_t state_hash = 0;             ///< State hash after its last tick.
  std::uint64_t mismatches = 0;             ///< Compared ticks with a different hash.
  std::optional<Departure> departure;       ///< First difference.
  std::map<std::string, HealthFigure> health;
  std::string missing;  ///< Data that the recording lacks to continue; empty: none.
  [[nodiscard]] bool good() const { return !departure && missing.empty() && compared > 0; }
};

struct LockStepResult {
  std::vector<NodeResult> nodes;
  double wall_s = 0;
  double session_s = 0;             ///< Session time replayed.
  std::vector<std::string> faults;  ///< Unreadable parts of the recording.
  /// True if all of the recording could be read and all states are the same.
  [[nodiscard]] bool good() const;
};

/// Replays each node on its own thread, because nodes with recorded inputs do not depend on each other. A node stops at
/// its first departure unless `go_on` is set. The calling thread calls `progress` every 0.1 s of session time with the
/// session time [s]. Throws InputError when recording, scene or cart do not allow a replay, MismatchError when the
/// recording is of another scene.
LockStepResult ReplayInLockStep(const LockStepSettings& settings, const SceneView& scene,
                                const config::CartConfig& cart, const std::function<void(double)>& progress);

}  // namespace fulcrum::replay
