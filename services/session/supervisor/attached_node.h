// A node that systemd starts and restarts: `fulcrum up --attach`. The supervisor writes a file with the node's
// arguments, identifies its process by the pid in its Health, and detects its death; it neither forks nor kills.
#pragma once

#include <functional>

#include "services/session/supervisor/supervised_node.h"

namespace fulcrum::supervisor {

/// A process that is not a child of the supervisor, watched through a pidfd until it ends.
class WatchedProcess {
 public:
  WatchedProcess() = default;
  ~WatchedProcess();
  WatchedProcess(WatchedProcess&& other) noexcept;
  WatchedProcess& operator=(WatchedProcess&& other) noexcept;

  /// Starts to watch `pid`; false when there is no such process.
  [[nodiscard]] bool Watch(pid_t pid);
  [[nodiscard]] bool HasEnded() const;
  void Close();
  [[nodiscard]] pid_t pid() const { return pid_; }  ///< 0: no process is watched.

 private:
  pid_t pid_ = 0;
  int fd_ = -1;
};

class AttachedNode final : public SupervisedNode {
 public:
  /// Sends a Command with this verb to a node.
  using Order = std::function<void(NodeId, const char* verb)>;
  /// @param folder where the file of arguments is written, under the node's name.
  AttachedNode(NodeCommand command, const std::filesystem::path& folder, Order order);

  /// Name of the folder of these files in the session folder.
  static constexpr const char* kFolder = "nodes";
  /// Environment file of a systemd unit: `FULCRUM_ARGUMENTS="…"`. Throws InputError when an argument is empty or
  /// contains a space, a quote, $, ` or \: a unit cannot pass these.
  [[nodiscard]] static std::string ArgumentsFile(const std::vector<std::string>& arguments);

  void Start(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<Death> Update(std::int64_t now_ns) override;
  bool OnHealth(const Health& health, std::int64_t now_ns) override;
  void ResetTimeouts(std::int64_t now_ns) override { missing_since_ns_ = now_ns; }
  void AskRestart(std::int64_t now_ns) override;
  void Swap(NodeCommand command, std::int64_t now_ns) override;
  void Stop() override;
  [[nodiscard]] bool HasEnded() override;
  const char* StopWaiting() override;

  [[nodiscard]] pid_t pid() const override { return process_.pid(); }
  [[nodiscard]] bool running() const override { return process_.pid() != 0; }
  [[nodiscard]] bool failed() const override { return failed_; }
  [[nodiscard]] bool has_reported() const override { return has_reported_; }
  [[nodiscard]] bool steps() const override { return has_reported_; }  // There are no pairs of services.
  [[nodiscard]] const NodeCommand& command() const override { return command_; }
  [[nodiscard]] std::string log() const override;

 private:
  NodeCommand command_;
  std::filesystem::path file_;
  Order order_;
  WatchedProcess process_;
  std::int64_t missing_since_ns_ = 0;  ///< Since when no process is known; valid while there is none.
  std::int64_t ended_ns_ = 0;          ///< When the end of the last process was detected.
  bool replaced_ = false;              ///< Another process has sent Health since that end.
  bool has_reported_ = false;
  bool ending_ = false;  ///< Its last Health had the state "stopping": it ends on command.
  bool asked_ = false;   ///< It has ended on command and has not rejoined.
  bool back_ = false;    ///< It has rejoined after that, which Update has not reported yet.
  bool failed_ = false;
};

}  // namespace fulcrum::supervisor
