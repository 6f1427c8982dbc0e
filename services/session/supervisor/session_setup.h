// The part of a session that is fixed before any node starts: settings, scene, session folder, nodes.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/scene/format/scene_file.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/session/supervisor/node_starter.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/supervisor.h"
#include "services/session/supervisor/training_log.h"
#include "services/transport/bus/security.h"

namespace fulcrum::supervisor {

/// The cart's private directory, removed with all it holds: keys, sockets, announcement.
struct SessionMemory {
  std::filesystem::path path;

  explicit SessionMemory(std::filesystem::path directory) : path(std::move(directory)) {}
  ~SessionMemory();
  SessionMemory(const SessionMemory&) = delete;
  SessionMemory& operator=(const SessionMemory&) = delete;
};

/// Session time of the end [s]; 0: until stopped, because a person moves the tools or the settings say so.
[[nodiscard]] double EndOfSession(const UpSettings& settings, const SceneView& scene);

struct SessionSetup {
  /// Checks the keys, takes the domain, opens shared memory and the trainees' database, makes the session folder.
  /// Throws InputError or MismatchError.
  explicit SessionSetup(const UpSettings& up);
  SessionSetup(const SessionSetup&) = delete;
  SessionSetup& operator=(const SessionSetup&) = delete;

  /// Settings of the supervisor's participant.
  [[nodiscard]] bus::Security security() const;
  /// The script that sets the generator; empty on a cart with a real pedal, where a person operates it.
  [[nodiscard]] std::span<const ScriptKey> operator_script() const;
  [[nodiscard]] bool has_recorder() const;
  /// When the session is over: the next one may begin in the domain. Removes the private directory first, which is the
  /// next session's from then on.
  void FreeDomain();

  const UpSettings settings;
  const scene::SceneFile scene;
  const double end_s;                      ///< Session time of the end [s]; 0: until stopped.
  const std::string keys_warning;          ///< One line on keys that expire soon; empty: none.
  const std::vector<std::string> notices;  ///< What the operator must know of this session, one line each.
  std::optional<DomainGuard> guard;        ///< Given back when the session is over, before its video is drawn.
  /// Directory on /dev/shm. Opened right after the guard: commands that find a session read its security settings
  /// there.
  std::optional<SessionMemory> opened;
  const std::filesystem::path memory;
  std::optional<TrainingLog> training;  ///< Empty: no trainee was named.
  const SessionFolder folder;
  const std::filesystem::path recording;  ///< The recorder's first file; empty: none.
  const NodeStarter starter;
  const std::vector<NodeId> node_ids;    ///< On this host, the recorder last.
  const std::vector<NodeId> remote_ids;  ///< Of the scene, on another host.
};

}  // namespace fulcrum::supervisor
