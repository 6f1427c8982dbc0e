#include "services/session/supervisor/attached_node.h"

#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <system_error>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/tick.h"
#include "services/session/supervisor/session_folder.h"

namespace fulcrum::supervisor {
namespace {

// Longer than a node takes to start: systemd has stopped restarting it by then.
constexpr std::int64_t kLongestAbsence = 60 * kSecond_ns;
// The last Health of a node that ends in good order may arrive after its process has ended.
constexpr std::int64_t kLastHealthDelay = kSecond_ns / 4;

}  // namespace

WatchedProcess::~WatchedProcess() { Close(); }

WatchedProcess::WatchedProcess(WatchedProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, 0)), fd_(std::exchange(other.fd_, -1)) {}

WatchedProcess& WatchedProcess::operator=(WatchedProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(fd_, other.fd_);
  return *this;
}

bool WatchedProcess::Watch(pid_t pid) {
  Close();
  fd_ = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));
  if (fd_ < 0) return false;
  pid_ = pid;
  return true;
}

bool WatchedProcess::HasEnded() const {
  pollfd ended{fd_, POLLIN, 0};
  return fd_ >= 0 && ::poll(&ended, 1, 0) == 1;
}

void WatchedProcess::Close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  pid_ = 0;
}

AttachedNode::AttachedNode(NodeCommand command, const std::filesystem::path& folder, Order order)
    : command_(std::move(command)), file_(folder / NodeName(command_.id)), order_(std::move(order)) {}

std::string AttachedNode::ArgumentsFile(const std::vector<std::string>& arguments) {
  std::string words;
  for (const std::string& argument : arguments) {
    // systemd would split or substitute these characters in the command line of the unit.
    if (argument.empty() || argument.find_first_of("\"'\\$` \t\r\n") != std::string::npos) {
      throw InputError("\"" + argument +
                       "\" cannot be passed to a service: spaces, quotes, $ and \\ are not possible in the places of "
                       "session and recording; see --out and --record-to");
    }
    words += (words.empty() ? "" : " ") + argument;
  }
  return "FULCRUM_ARGUMENTS=\"" + words + "\"\n";
}

void AttachedNode::Start(std::int64_t now_ns) {
  std::error_code ignored;  // Without the folder, WriteFile throws.
  std::filesystem::create_directories(file_.parent_path(), ignored);
  WriteFile(file_, ArgumentsFile(command_.arguments));
  missing_since_ns_ = now_ns;
}

std::optional<SupervisedNode::Death> AttachedNode::Update(std::int64_t now_ns) {
  if (failed_) return std::nullopt;
  if (std::exchange(back_, false)) return Death{"was restarted", false, {}, true, std::exchange(ended_ns_, 0)};
  if (process_.HasEnded()) {
    if (ended_ns_ == 0) ended_ns_ = now_ns;
    if (!ending_ && !replaced_ && now_ns - ended_ns_ < kLastHealthDelay) return std::nullopt;
    process_.Close();
    missing_since_ns_ = now_ns;
    // An end in good order is reported as a restart only after the node has rejoined: when systemd stops the whole
    // cart, the node does not start again.
    asked_ = ending_;
    if (!asked_) return Death{"has died", false, {}, false, ended_ns_};
  }
  if (!running() && now_ns - missing_since_ns_ > kLongestAbsence) {
    failed_ = true;
    return Death{has_reported_ ? "was not restarted within 60 s" : "was not started within 60 s", true, {}, false, 0};
  }
  return std::nullopt;
}

bool AttachedNode::OnHealth(const Health& health, std::int64_t /*now_ns*/) {
  if (health.node != id()) return false;
  if (!running()) {
    // A late sample may name a process that no longer exists.
    if (!process_.Watch(health.pid)) return false;
    back_ = std::exchange(asked_, false);
    if (!back_) ended_ns_ = 0;
    ending_ = replaced_ = false;
  }
  if (health.pid != pid()) {
    replaced_ |= process_.HasEnded();
    return false;
  }
  has_reported_ = true;
  ending_ = health.state == HealthState::kStopping;
  return true;
}

void AttachedNode::AskRestart(std::int64_t /*now_ns*/) { order_(id(), "restart"); }

void AttachedNode::Swap(NodeCommand /*command*/, std::int64_t /*now_ns*/) {
  throw InputError(std::string(NodeName(id())) +
                   " of this session is a service: give it another ExecStart= (systemctl edit), then restart it");
}

void AttachedNode::Stop() {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);  // Without this file systemd does not start the node again.
  if (running()) order_(id(), "stop");
}

bool AttachedNode::HasEnded() { return !running() || process_.HasEnded(); }

const char* AttachedNode::StopWaiting() {
  process_.Close();
  return "was left running for systemd to stop";
}

std::string AttachedNode::log() const { return std::string("journalctl -t ") + NodeName(id()); }

}  // namespace fulcrum::supervisor
