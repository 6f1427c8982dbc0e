// The nodes of a session on this host: starts them, watches and restarts them, ends them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/core/exit_code.h"
#include "services/session/supervisor/attached_node.h"
#include "services/session/supervisor/command_desk.h"
#include "services/session/supervisor/session_setup.h"
#include "services/session/supervisor/supervised_node.h"

namespace fulcrum::supervisor {

/// The running node of this name, of a standby pair the one that leads; nullptr: none runs.
[[nodiscard]] SupervisedNode* FindRunning(std::span<const std::unique_ptr<SupervisedNode>> nodes,
                                          std::string_view name);

class SessionNodes {
 public:
  /// @param setup must outlive this.
  /// @param order sends a verb to a node that systemd runs as a service.
  SessionNodes(const SessionSetup& setup, const AttachedNode::Order& order);

  /// Throws InputError when a program cannot be started.
  void Start(std::int64_t now_ns);

  using OnDeath = std::function<void(const SupervisedNode& node, const SupervisedNode::Death& death)>;
  /// Stage of the loop: calls `died` for each node that has died since the last call, and sweeps shared memory
  /// kSweepAfter_ns after the last death.
  void Watch(std::int64_t now_ns, const OnDeath& died);
  /// Ends all nodes, the recorder last, so that its file contains the end of the others. `turn` and `given_up` as for
  /// EndAll.
  void End(const std::function<void(std::int64_t now_ns)>& turn,
           const std::function<void(const SupervisedNode& node, const char* done)>& given_up);

  /// Restart by command, of a standby pair the one that leads. nullopt: no such node runs here.
  [[nodiscard]] std::optional<CommandAnswer> Restart(const std::string& name, std::int64_t now_ns);
  /// Swap by command. @param argument the node, then the words of NodeStarter::Replacement, one per line.
  CommandAnswer Swap(const std::string& argument, std::int64_t now_ns);
  /// Reply to a command that names no running node.
  [[nodiscard]] static CommandAnswer NotRunning(const std::string& name);

  /// True shortly after a restart or swap by command: a node that is degraded then reports the absence of its peer,
  /// which is no fault.
  [[nodiscard]] bool IsExcused(std::int64_t now_ns) const { return now_ns < excused_ns_; }
  /// True when each node has reported or has failed for good.
  [[nodiscard]] bool AreReady() const;
  [[nodiscard]] std::size_t running() const;
  [[nodiscard]] std::span<const std::unique_ptr<SupervisedNode>> all() const { return nodes_; }

  /// The last node that failed for good.
  struct Failure {
    ExitCode code = ExitCode::kDone;  ///< kDone: none failed.
    std::string why;
  };
  [[nodiscard]] const Failure& failure() const { return failure_; }

 private:
  const SessionSetup& setup_;
  std::vector<std::unique_ptr<SupervisedNode>> nodes_;
  std::int64_t last_watch_ns_ = 0;
  std::int64_t sweep_ns_ = 0;    ///< Time of the next sweep; 0: none is due.
  std::int64_t excused_ns_ = 0;  ///< End of the time in which IsExcused is true.
  Failure failure_;
};

}  // namespace fulcrum::supervisor
