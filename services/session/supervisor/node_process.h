// A node as a child of the supervisor: process, health watch, restarts.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "services/session/supervisor/node_pulse.h"
#include "services/session/supervisor/restart_policy.h"
#include "services/session/supervisor/spare_process.h"
#include "services/session/supervisor/supervised_node.h"

namespace fulcrum::supervisor {

class NodeProcess final : public SupervisedNode {
 public:
  explicit NodeProcess(NodeCommand command) : command_(std::move(command)) {}

  void Start(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<Death> Update(std::int64_t now_ns) override;

  bool OnHealth(const Health& health, std::int64_t now_ns) override;
  void ResetTimeouts(std::int64_t now_ns) override;
  void AskRestart(std::int64_t now_ns) override;
  void Swap(NodeCommand command, std::int64_t now_ns) override;
  void Stop() override;
  [[nodiscard]] bool HasEnded() override;
  const char* StopWaiting() override;

  [[nodiscard]] pid_t pid() const override { return process_.pid(); }
  [[nodiscard]] bool running() const override { return process_.running(); }
  [[nodiscard]] bool failed() const override { return failed_; }
  [[nodiscard]] bool has_reported() const override { return pulse_.has_reported(); }
  [[nodiscard]] bool steps() const override { return pulse_.steps(); }
  [[nodiscard]] const NodeCommand& command() const override { return command_; }
  [[nodiscard]] std::string log() const override { return command_.log.string(); }

 private:
  void WatchPulse(std::int64_t now_ns);
  /// Starts a spare once the node runs. A spare that ends is replaced only after the next start of the node.
  void KeepSpare(std::int64_t now_ns);
  /// Starts the previous program again after its replacement ended without a Health.
  Death GiveBack(const std::string& why, const runtime::ProcessEnd& end, std::int64_t now_ns);

  NodeCommand command_;
  std::optional<NodeCommand> next_, before_;  ///< Of a swap. `before_` is kept until the new program sends Health.
  runtime::ChildProcess process_;
  std::unique_ptr<SpareProcess> spare_;
  RestartPolicy policy_;
  std::int64_t started_ns_ = 0;
  NodePulse pulse_;
  std::int64_t due_ns_ = 0;          ///< Time of the next start; 0: the process runs.
  std::int64_t kill_ns_ = 0;         ///< Time of SIGKILL in a restart by command; 0: no such restart.
  bool lacks_ = false;               ///< The system had no means for the last start.
  const char* complaint_ = nullptr;  ///< Why it was killed; nullptr: it was not.
  bool failed_ = false;
};

/// Ends all nodes: calls Stop on each, and StopWaiting on those that still run a second after their LongestEnd_s
/// (services/nodes/app/longest_end.h). `given_up` is called with such a node and what was done to it; `turn` is called
/// repeatedly while the nodes end.
void EndAll(const std::vector<SupervisedNode*>& nodes, const std::function<void(std::int64_t now_ns)>& turn,
            const std::function<void(const SupervisedNode& node, const char* done)>& given_up);

/// Last line of a log, for messages; empty when there is none.
[[nodiscard]] std::string LastLine(const std::filesystem::path& log);

}  // namespace fulcrum::supervisor
