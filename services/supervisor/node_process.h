// One supervised node: process, health watch, restarts.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/core/messages.h"
#include "services/supervisor/child_process.h"
#include "services/supervisor/restart_policy.h"

namespace fulcrum::supervisor {

/// How to start it.
struct NodeCommand {
  NodeId id = NodeId::kSupervisor;
  std::filesystem::path program;
  std::vector<std::string> arguments;
  std::filesystem::path log;
  std::vector<std::string> again;  ///< More arguments, from the second start on.
  bool foreign = false;            ///< Not one of our nodes: its Health, if any, may name another process.
};

class NodeProcess {
 public:
  explicit NodeProcess(NodeCommand command) : command_(std::move(command)) {}

  /// Throws InputError when the program cannot be started.
  void Start(std::int64_t now_ns);

  struct Death {
    std::string cause;
    bool for_good = false;
    ProcessEnd end;
    bool asked = false;  ///< By AskRestart.
  };
  /// Notices a death and starts again when that is due.
  [[nodiscard]] std::optional<Death> Update(std::int64_t now_ns);

  void OnHealth(std::int64_t now_ns) {
    last_health_ns_ = now_ns;
    before_.reset();
  }
  /// Forgives silence up to now, because the supervisor itself was held up.
  void ForgiveSilence(std::int64_t now_ns);
  void AskRestart(std::int64_t now_ns);
  /// Restarts as another program. When that ends before its first Health, the one before is started again.
  void Swap(NodeCommand command, std::int64_t now_ns);
  void Signal(int signal) const { process_.Signal(signal); }
  /// For the end of the session: reaps without starting again. True when no process is left.
  [[nodiscard]] bool HasEnded();

  [[nodiscard]] NodeId id() const { return command_.id; }
  [[nodiscard]] pid_t pid() const { return process_.pid(); }
  [[nodiscard]] bool running() const { return process_.running(); }
  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] const NodeCommand& command() const { return command_; }
  [[nodiscard]] bool foreign() const { return command_.foreign; }
  [[nodiscard]] bool has_reported() const { return last_health_ns_ != 0; }
  [[nodiscard]] const std::filesystem::path& log() const { return command_.log; }

 private:
  void WatchForSilence(std::int64_t now_ns);

  NodeCommand command_;
  std::optional<NodeCommand> next_, before_;  ///< Of a swap; `before_` until the new one has reported.
  ChildProcess process_;
  RestartPolicy policy_;
  std::int64_t started_ns_ = 0;
  std::int64_t last_health_ns_ = 0;  ///< 0: none since the start.
  std::int64_t due_ns_ = 0;          ///< When to start again; 0: not dead.
  std::int64_t kill_ns_ = 0;         ///< When patience with an asked restart ends; 0: none asked.
  bool silent_ = false;              ///< Killed for silence.
  bool failed_ = false;
};

/// Last line of a log, for people; empty when there is none.
[[nodiscard]] std::string LastLine(const std::filesystem::path& log);

}  // namespace fulcrum::supervisor
