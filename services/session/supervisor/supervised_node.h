// Interface of the supervisor to one node of a session: a child process (node_process) or a service that systemd runs
// (attached_node).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/runtime/child_process.h"

namespace fulcrum::supervisor {

/// Command line of a node.
struct NodeCommand {
  NodeId id = NodeId::kSupervisor;
  std::filesystem::path program;
  std::vector<std::string> arguments;
  std::filesystem::path log;
  std::vector<std::string> again;  ///< Further arguments from the second start on.
  bool has_spare = false;  ///< Accepts --spare (services/nodes/app/spare.h) and starts slowly enough to need a spare.
  bool foreign = false;    ///< Not a node of this build: its Health, if any, may contain the pid of another process.
};

class SupervisedNode {
 public:
  virtual ~SupervisedNode() = default;

  /// Starts the node. Throws InputError when the program cannot be started.
  virtual void Start(std::int64_t now_ns) = 0;

  struct Death {
    std::string cause;
    bool for_good = false;
    runtime::ProcessEnd end;
    bool asked = false;      ///< The node ended by command (AskRestart, Swap).
    std::int64_t at_ns = 0;  ///< Time of the death; 0: now.
  };
  /// Detects a death and, unless it is for good, restarts the node when its delay is over. Returns each death once.
  [[nodiscard]] virtual std::optional<Death> Update(std::int64_t now_ns) = 0;

  /// Takes a Health. Returns false when it is of another node or another process.
  virtual bool OnHealth(const Health& health, std::int64_t now_ns) = 0;
  /// Restarts the measurement of silence at `now_ns`, because the supervisor itself was suspended.
  virtual void ResetTimeouts(std::int64_t now_ns) = 0;
  virtual void AskRestart(std::int64_t now_ns) = 0;
  /// Restarts the node as another program. When that ends before its first Health, the previous program is started
  /// again. Throws InputError when this node cannot be replaced.
  virtual void Swap(NodeCommand command, std::int64_t now_ns) = 0;

  /// Requests the end of the node at the end of the session.
  virtual void Stop() = 0;
  /// True when no process is left. Starts none again.
  [[nodiscard]] virtual bool HasEnded() = 0;
  /// Handles a node that does not end after Stop; returns what was done, for messages.
  virtual const char* StopWaiting() = 0;

  [[nodiscard]] virtual pid_t pid() const = 0;
  [[nodiscard]] virtual bool running() const = 0;
  [[nodiscard]] virtual bool failed() const = 0;
  [[nodiscard]] virtual bool has_reported() const = 0;
  /// True when its newest Health says that it runs, and not that it waits: of a standby pair, the one that leads.
  [[nodiscard]] virtual bool steps() const = 0;
  [[nodiscard]] virtual const NodeCommand& command() const = 0;
  /// Where its output can be read: a file, or a command.
  [[nodiscard]] virtual std::string log() const = 0;
  [[nodiscard]] NodeId id() const { return command().id; }

 protected:
  SupervisedNode() = default;
  SupervisedNode(const SupervisedNode&) = default;
  SupervisedNode& operator=(const SupervisedNode&) = default;
  SupervisedNode(SupervisedNode&&) = default;
  SupervisedNode& operator=(SupervisedNode&&) = default;
};

}  // namespace fulcrum::supervisor
