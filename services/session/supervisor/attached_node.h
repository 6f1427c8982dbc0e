// A node that somebody else starts and restarts (systemd): `fulcrum up --attach`. The supervisor gives it a file with
// its arguments, knows it by its Health, and notices its death; it neither forks nor kills.
#pragma once

#include <functional>

#include "services/session/supervisor/supervised_node.h"

namespace fulcrum::supervisor {

/// A process that is not our child, watched until it ends (pidfd).
class WatchedProcess {
 public:
  WatchedProcess() = default;
  ~WatchedProcess();
  WatchedProcess(WatchedProcess&& other) noexcept;
  WatchedProcess& operator=(WatchedProcess&& other) noexcept;

  /// False when there is no such process.
  [[nodiscard]] bool Watch(pid_t pid);
  [[nodiscard]] bool HasEnded() const;
  void Forget();
  [[nodiscard]] pid_t pid() const { return pid_; }  ///< 0: none.

 private:
  pid_t pid_ = 0;
  int fd_ = -1;
};

class AttachedNode final : public SupervisedNode {
 public:
  /// Sends a Command with this verb to a node.
  using Order = std::function<void(NodeId, const char* verb)>;
  /// `folder`: the file of arguments is written here, under the node's name.
  AttachedNode(NodeCommand command, const std::filesystem::path& folder, Order order);

  /// The folder of the files, in the session's.
  static constexpr const char* kFolder = "nodes";
  /// What a unit of systemd reads: `FULCRUM_ARGUMENTS="…"`. Throws InputError for what no unit could pass on.
  [[nodiscard]] static std::string ArgumentsFile(const std::vector<std::string>& arguments);

  void Start(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<Death> Update(std::int64_t now_ns) override;
  bool OnHealth(const Health& health, std::int64_t now_ns) override;
  void ForgiveSilence(std::int64_t now_ns) override { missing_since_ns_ = now_ns; }
  void AskRestart(std::int64_t now_ns) override;
  void Swap(NodeCommand command, std::int64_t now_ns) override;
  void Stop() override;
  [[nodiscard]] bool HasEnded() override;
  const char* GiveUp() override;

  [[nodiscard]] pid_t pid() const override { return process_.pid(); }
  [[nodiscard]] bool running() const override { return process_.pid() != 0; }
  [[nodiscard]] bool failed() const override { return failed_; }
  [[nodiscard]] bool has_reported() const override { return has_reported_; }
  [[nodiscard]] const NodeCommand& command() const override { return command_; }
  [[nodiscard]] std::string log() const override;

 private:
  NodeCommand command_;
  std::filesystem::path file_;
  Order order_;
  WatchedProcess process_;
  std::int64_t missing_since_ns_ = 0;  ///< While no process is known.
  std::int64_t ended_ns_ = 0;          ///< When the last one was seen to have ended.
  bool replaced_ = false;              ///< Another one has reported since.
  bool has_reported_ = false;
  bool ending_ = false;  ///< Its last Health said so: it was asked to.
  bool asked_ = false;   ///< Ended as it was asked to, and not back yet.
  bool back_ = false;    ///< Came back from that; not told yet.
  bool failed_ = false;
};

}  // namespace fulcrum::supervisor
