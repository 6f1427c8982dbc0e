#include "services/base/runtime/child_process.h"

#include <fcntl.h>
#include <linux/close_range.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <utility>

#include "services/base/core/exit_code.h"

namespace fulcrum::runtime {
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

[[noreturn]] void Fail(const std::string& what, int error) {
  const std::string text = what + ": " + ::strerror(error);
  if (error == EMFILE || error == ENFILE || error == EAGAIN || error == ENOMEM) throw ShortageError(text);
  throw InputError(text);
}

/// Runs in the child between fork and exec, where other threads of the parent may have held any lock: only
/// async-signal-safe calls are allowed. Returns only on failure, with errno set.
void Become(const char* program, char* const* arguments, const ChildStreams& streams, WithParent with_parent,
            pid_t parent) {
  if (with_parent == WithParent::kDies) {
    // SIGKILL, because a hanging node must not outlive its supervisor either; checkpoints make the kill harmless.
    if (::prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return;
    if (::getppid() != parent) ::_exit(1);  // The parent died before prctl took effect.
  }
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  // With a process group per child, Ctrl-C on the terminal reaches the parent alone, which then stops its children
  // in good order.
  if (::setpgid(0, 0) != 0) return;
  const int input = streams.input >= 0 ? streams.input : ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (input < 0 || ::dup2(input, STDIN_FILENO) < 0) return;
  const int error = streams.error >= 0 ? streams.error : streams.output;
  if (::dup2(streams.output, STDOUT_FILENO) < 0 || ::dup2(error, STDERR_FILENO) < 0) return;
  // The bus opens its sockets without CLOEXEC: a child would keep the ports of the link from a participant that is made
  // again, and could read what is sent to this process. Best effort: without it (before Linux 5.11) the child works.
  (void)::close_range(STDERR_FILENO + 1, ~0u, CLOSE_RANGE_CLOEXEC);
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
  if (running() && with_parent_ == WithParent::kDies) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), with_parent_(other.with_parent_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(with_parent_, other.with_parent_);
  return *this;
}

ChildProcess ChildProcess::Start(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                 const std::filesystem::path& log, WithParent with_parent, int input) {
  const int log_fd = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log_fd < 0) Fail("cannot write " + log.string(), errno);
  try {
    ChildProcess process = StartOn(program, arguments, {.input = input, .output = log_fd}, with_parent);
    ::close(log_fd);
    return process;
  } catch (...) {
    ::close(log_fd);
    throw;
  }
}

ChildProcess ChildProcess::StartOn(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                   const ChildStreams& streams, WithParent with_parent) {
  const auto fail = [&](int error) { Fail("cannot start " + program.string(), error); };
  std::vector<char*> pointers{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) {
    pointers.push_back(const_cast<char*>(argument.c_str()));
  }
  pointers.push_back(nullptr);
  // The child reports a failed start through this pipe; a successful exec closes it.
  int report[2];
  if (::pipe2(report, O_CLOEXEC) != 0) {
    fail(errno);
  }
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    Become(program.c_str(), pointers.data(), streams, with_parent, parent);
    const int error = errno;
    [[maybe_unused]] const ssize_t written = ::write(report[1], &error, sizeof(error));
    ::_exit(127);
  }
  int error = child < 0 ? errno : 0;
  ::close(report[1]);
  ChildProcess process;
  process.with_parent_ = with_parent;
  if (child > 0) {
    process.pid_ = child;
    if (::read(report[0], &error, sizeof(error)) != static_cast<ssize_t>(sizeof(error))) {
      error = 0;
    }
  }
  ::close(report[0]);
  if (error != 0) {
    process.with_parent_ = WithParent::kDies;  // A program that did not start must not stay.
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

std::filesystem::path FindInPath(const std::string& name) {
  const char* folders = std::getenv("PATH");
  std::istringstream list(folders != nullptr ? folders : "");
  for (std::string folder; std::getline(list, folder, ':');) {
    std::filesystem::path program = std::filesystem::path(folder) / name;
    if (!folder.empty() && ::access(program.c_str(), X_OK) == 0 && !std::filesystem::is_directory(program)) {
      return program;
    }
  }
  return {};
}

}  // namespace fulcrum::runtime
