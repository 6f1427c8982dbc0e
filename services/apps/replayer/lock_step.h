// Lock-step replay: nodes make the ticks of a recording again, and what they come to is compared with what they came to
// then.
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
  std::vector<NodeId> nodes;     ///< Of physics, thermal, haptics.
  std::filesystem::path folder;  ///< For checkpoints of the replayed nodes; must exist.
  double rate = 0;               ///< Times real time; 0: as fast as it can.
  int physics_threads = 1;       ///< That share a step of physics; the states do not depend on it.
  double until_s = -1;           ///< Session time at which it ends; negative: the end of the recording.
  bool go_on = false;            ///< Past a state that differs.
  bool figures = false;          ///< Of Health are all asked for, those of the force on tools among them.
};

/// The first tick after which a node's state is not what it was.
struct Departure {
  std::uint64_t tick = 0;
  double session_time_s = 0;
  std::int64_t stamp_ns = 0;
  std::uint64_t epoch = 0;
  std::uint64_t recorded_hash = 0, replayed_hash = 0;
  std::string field;  ///< Topic, field, index and both values of what it published; or that nothing of it shows.
};

/// A figure of a node's Health, looked at as often as the node would have told it.
struct HealthFigure {
  double last = 0, least = 0, most = 0;
};

struct NodeResult {
  NodeId node = NodeId::kPhysics;
  std::uint64_t ticks = 0;             ///< Made.
  std::uint64_t compared = 0;          ///< Of them, those whose hash the recording has.
  std::uint64_t starts = 0;            ///< Of the node: 1 and its restarts.
  double session_time_s = 0;           ///< Of its last tick.
  double busy_s = 0;                   ///< Computing.
  std::uint64_t state_hash = 0;        ///< After its last tick.
  std::uint64_t mismatches = 0;        ///< Of those compared.
  std::optional<Departure> departure;  ///< The first.
  std::map<std::string, HealthFigure> health;
  std::string missing;  ///< Why it could not go on; empty: nothing was missing.
  [[nodiscard]] bool good() const { return !departure && missing.empty() && compared > 0; }
};

struct LockStepResult {
  std::vector<NodeResult> nodes;
  double wall_s = 0;
  double session_s = 0;             ///< Session time replayed.
  std::vector<std::string> faults;  ///< Of the recording: what in it could not be read.
  [[nodiscard]] bool good() const;
};

/// Each node on a thread of its own: with recorded inputs they need nothing of each other. Stops a node at its first
/// departure, unless told to go on. `progress` is called now and then with the session time [s], by the calling thread.
/// Throws InputError when recording, scene or cart do not allow a replay, MismatchError when the recording is of
/// another scene.
LockStepResult ReplayInLockStep(const LockStepSettings& settings, const SceneView& scene,
                                const config::CartConfig& cart, const std::function<void(double)>& progress);

}  // namespace fulcrum::replay
