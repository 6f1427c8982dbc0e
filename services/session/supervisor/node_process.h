// A node as a child of the supervisor: process, health watch, restarts.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

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
  void ForgiveSilence(std::int64_t now_ns) override;
  void AskRestart(std::int64_t now_ns) override;
  void Swap(NodeCommand command, std::int64_t now_ns) override;
  void Stop() override;
  [[nodiscard]] bool HasEnded() override;
  const char* GiveUp() override;

  [[nodiscard]] pid_t pid() const override { return process_.pid(); }
  [[nodiscard]] bool running() const override { return process_.running(); }
  [[nodiscard]] bool failed() const override { return failed_; }
  [[nodiscard]] bool has_reported() const override { return last_health_ns_ != 0; }
  [[nodiscard]] const NodeCommand& command() const override { return command_; }
  [[nodiscard]] std::string log() const override { return command_.log.string(); }

 private:
  void WatchForSilence(std::int64_t now_ns);
  /// Starts a spare when the node runs; one that ends is not started again before the node is.
  void KeepSpare(std::int64_t now_ns);
  /// In the place of a replacement that was never heard of.
  Death GiveBack(const std::string& why, const ProcessEnd& end, std::int64_t now_ns);

  NodeCommand command_;
  std::optional<NodeCommand> next_, before_;  ///< Of a swap; `before_` until the new one has reported.
  ChildProcess process_;
  std::unique_ptr<SpareProcess> spare_;
  RestartPolicy policy_;
  std::int64_t started_ns_ = 0;
  std::int64_t last_health_ns_ = 0;  ///< 0: none since the start.
  std::int64_t due_ns_ = 0;          ///< When to start again; 0: not dead.
  std::int64_t kill_ns_ = 0;         ///< When patience with an asked restart ends; 0: none asked.
  bool silent_ = false;              ///< Killed for silence.
  bool failed_ = false;
};

/// Ends all of them: asks, and gives up who has not ended 4 s later; `given_up` is told who, and what was done. `turn`
/// is called while they end.
void EndAll(const std::vector<SupervisedNode*>& nodes, const std::function<void(std::int64_t now_ns)>& turn,
            const std::function<void(const SupervisedNode& node, const char* done)>& given_up);

/// Last line of a log, for people; empty when there is none.
[[nodiscard]] std::string LastLine(const std::filesystem::path& log);

}  // namespace fulcrum::supervisor
