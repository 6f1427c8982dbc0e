#include "services/supervisor/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "services/core/error.h"
#include "services/core/exit_code.h"

namespace fulcrum::supervisor {
namespace {

const char* Meaning(int exit_code) {
  switch (static_cast<ExitCode>(exit_code)) {
    case ExitCode::kDone:
      return "done";
    case ExitCode::kBadUsage:
      return "bad use or configuration";
    case ExitCode::kMismatch:
      return "scene or schema mismatch";
    case ExitCode::kDeviceLost:
      return "device lost for good";
    case ExitCode::kFailure:
      break;
  }
  return "failure";
}

/// In the child, between fork and exec: other threads of the parent may have held any lock, so only
/// async-signal-safe calls. Returns only when something failed, with errno set.
void Become(const char* program, char* const* arguments, int log, pid_t parent) {
  // SIGKILL, since a node that hangs must not outlive its supervisor either; checkpoints make it harmless.
  if (::prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return;
  if (::getppid() != parent) ::_exit(1);  // The parent died before prctl took effect.
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  // A group of its own: Ctrl-C on the terminal reaches the supervisor alone, which ends its children in good order.
  if (::setpgid(0, 0) != 0) return;
  const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (nothing < 0 || ::dup2(nothing, STDIN_FILENO) < 0) return;
  if (::dup2(log, STDOUT_FILENO) < 0 || ::dup2(log, STDERR_FILENO) < 0) return;
  ::execv(program, arguments);
}

}  // namespace

std::string ProcessEnd::Describe() const {
  if (signal != 0) {
    return "killed by signal " + std::to_string(signal) + " (" + ::strsignal(signal) + ")";
  }
  return "ended with exit code " + std::to_string(exit_code) + " (" + Meaning(exit_code) + ")";
}

ChildProcess::~ChildProcess() {
  if (running()) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept : pid_(std::exchange(other.pid_, -1)) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  return *this;
}

ChildProcess ChildProcess::Start(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                 const std::filesystem::path& log) {
  const auto fail = [&](int error) { throw InputError("cannot start " + program.string() + ": " + ::strerror(error)); };
  std::vector<char*> pointers{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) {
    pointers.push_back(const_cast<char*>(argument.c_str()));
  }
  pointers.push_back(nullptr);
  const int log_fd = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log_fd < 0) {
    throw InputError("cannot write " + log.string() + ": " + ::strerror(errno));
  }
  // The child reports a failed start through this pipe; a successful exec closes it.
  int report[2];
  if (::pipe2(report, O_CLOEXEC) != 0) {
    const int error = errno;
    ::close(log_fd);
    fail(error);
  }
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    Become(program.c_str(), pointers.data(), log_fd, parent);
    const int error = errno;
    [[maybe_unused]] const ssize_t written = ::write(report[1], &error, sizeof(error));
    ::_exit(127);
  }
  int error = child < 0 ? errno : 0;
  ::close(log_fd);
  ::close(report[1]);
  ChildProcess process;
  if (child > 0) {
    process.pid_ = child;
    if (::read(report[0], &error, sizeof(error)) != static_cast<ssize_t>(sizeof(error))) {
      error = 0;
    }
  }
  ::close(report[0]);
  if (error != 0) {
    fail(error);
  }
  return process;
}

std::optional<ProcessEnd> ChildProcess::Poll() {
  int status = 0;
  if (!running() || ::waitpid(pid_, &status, WNOHANG) != pid_) {
    return std::nullopt;
  }
  pid_ = -1;
  if (WIFSIGNALED(status)) {
    return ProcessEnd{0, WTERMSIG(status)};
  }
  return ProcessEnd{WEXITSTATUS(status), 0};
}

void ChildProcess::Signal(int signal) const {
  if (running()) {
    ::kill(pid_, signal);
  }
}

}  // namespace fulcrum::supervisor
