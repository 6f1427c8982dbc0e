// One node of a session as the supervisor sees it: a child of its own (node_process) or a service that systemd runs
// (attached_node).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/session/supervisor/child_process.h"

namespace fulcrum::supervisor {

/// How to start it.
struct NodeCommand {
  NodeId id = NodeId::kSupervisor;
  std::filesystem::path program;
  std::vector<std::string> arguments;
  std::filesystem::path log;
  std::vector<std::string> again;  ///< More arguments, from the second start on.
  bool has_spare = false;  ///< Understands --spare (services/nodes/app/spare.h), and starts slowly enough to need one.
  bool foreign = false;    ///< Not one of our nodes: its Health, if any, may name another process.
};

class SupervisedNode {
 public:
  virtual ~SupervisedNode() = default;

  /// Throws InputError when the program cannot be started.
  virtual void Start(std::int64_t now_ns) = 0;

  struct Death {
    std::string cause;
    bool for_good = false;
    ProcessEnd end;
    bool asked = false;      ///< By AskRestart.
    std::int64_t at_ns = 0;  ///< When; 0: now.
  };
  /// Notices a death and sees to it that the node comes back.
  [[nodiscard]] virtual std::optional<Death> Update(std::int64_t now_ns) = 0;

  /// False when it is not this node's, or that of another process.
  virtual bool OnHealth(const Health& health, std::int64_t now_ns) = 0;
  /// Forgives silence up to now, because the supervisor itself was held up.
  virtual void ForgiveSilence(std::int64_t now_ns) = 0;
  virtual void AskRestart(std::int64_t now_ns) = 0;
  /// Restarts as another program. When that ends before its first Health, the one before is started again. Throws
  /// InputError when this node cannot be replaced.
  virtual void Swap(NodeCommand command, std::int64_t now_ns) = 0;

  /// For the end of the session: asks it to end.
  virtual void Stop() = 0;
  /// Without starting it again. True when no process is left.
  [[nodiscard]] virtual bool HasEnded() = 0;
  /// For one that does not end; says what was done.
  virtual const char* GiveUp() = 0;

  [[nodiscard]] virtual pid_t pid() const = 0;
  [[nodiscard]] virtual bool running() const = 0;
  [[nodiscard]] virtual bool failed() const = 0;
  [[nodiscard]] virtual bool has_reported() const = 0;
  [[nodiscard]] virtual const NodeCommand& command() const = 0;
  /// Where to read what it said, for people.
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
