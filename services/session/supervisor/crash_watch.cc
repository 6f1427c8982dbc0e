#include "services/session/supervisor/crash_watch.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/base/core/error.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/transport/bus/dds/shared_memory.h"

namespace fulcrum::supervisor {
namespace fs = std::filesystem;
namespace {

// From SIGKILL to the end of a child: longer only if the kernel waits for a device.
constexpr int kLongestDeath_ms = 1000;
// The kernel releases the domain when the last copy of its socket is closed; a child between fork and exec has one.
constexpr int kGuardTries = 20, kGuardPause_ms = 10;

void Pause(int time_ms) {
  timespec time{time_ms / 1000, time_ms % 1000 * 1'000'000L};
  ::nanosleep(&time, nullptr);
}

int OpenProcess(pid_t pid) { return static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)); }

/// The domain, as soon as nobody holds it; empty when another session has taken it.
std::optional<int> TryFor(int domain, const auto& work) {
  for (int i = 0; i < kGuardTries; ++i) {
    try {
      const DomainGuard guard(domain);
      return work();
    } catch (const InputError&) {
      Pause(kGuardPause_ms);
    }
  }
  return std::nullopt;
}

/// Removes shared memory and checkpoints; returns how many files of shared memory those were.
int Remove(int domain, const fs::path& memory, const SessionFolder& folder) {
  const std::optional<int> files = TryFor(domain, [&] { return bus::RemoveSharedMemory(memory).files; });
  try {
    RemoveCheckpoints(folder);
  } catch (const fs::filesystem_error&) {  // Somebody has removed the folder.
  }
  return files.value_or(0);
}

/// Reads the domain of "fulcrum-<uid>-<domain>"; -1: another name.
int DomainOfName(const std::string& name) {
  const std::string begin = "fulcrum-" + std::to_string(::getuid()) + "-";
  int domain = -1;
  if (!name.starts_with(begin)) return -1;
  const auto [end, error] = std::from_chars(name.data() + begin.size(), name.data() + name.size(), domain);
  return error == std::errc() && end == name.data() + name.size() ? domain : -1;
}

}  // namespace

/// Memory that supervisor and watching process share. Relaxed: numbers that publish no other data.
struct CrashWatch::Shared {
  std::array<std::atomic<pid_t>, kMostChildren> children;
  std::atomic<bool> done;

  /// Runs in the watching process.
  void KillChildren() const {
    std::vector<int> dying;
    for (const std::atomic<pid_t>& child : children) {
      const pid_t pid = child.load(std::memory_order_relaxed);
      if (pid <= 1) continue;
      if (const int process = OpenProcess(pid); process >= 0) dying.push_back(process);
      ::kill(-pid, SIGKILL);
      ::kill(pid, SIGKILL);  // It may have died before it made a process group.
    }
    for (const int process : dying) {
      pollfd ended{process, POLLIN, 0};
      ::poll(&ended, 1, kLongestDeath_ms);
      ::close(process);
    }
  }
};

namespace {

/// Leaves the terminal, the signals and the files of the supervisor; keeps standard error and `supervisor`.
void StandAlone(int* supervisor) {
  ::setsid();
  ::prctl(PR_SET_NAME, "crash_watch");
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE}) ::signal(signal, SIG_IGN);
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  ::dup2(nothing, STDIN_FILENO);
  ::dup2(nothing, STDOUT_FILENO);
  constexpr int kFirstFile = STDERR_FILENO + 1;
  if (*supervisor != kFirstFile) *supervisor = ::dup2(*supervisor, kFirstFile);
  ::syscall(SYS_close_range, kFirstFile + 1, ~0u, 0);
  [[maybe_unused]] const int ignored = ::chdir("/");
}

}  // namespace

CrashWatch::CrashWatch(int domain, fs::path memory, SessionFolder folder)
    : domain_(domain), memory_(std::move(memory)), folder_(std::move(folder)) {
  void* map = ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  const pid_t supervisor = ::getpid();
  int self = map == MAP_FAILED ? -1 : OpenProcess(supervisor);
  if (self >= 0) {
    shared_ = new (map) Shared{};
    watcher_ = ::fork();
  }
  if (self < 0 || watcher_ < 0) {
    throw InputError(std::string("no process can be made that cleans up after a killed supervisor: ") +
                     ::strerror(errno));
  }
  if (watcher_ > 0) {
    ::close(self);
    return;
  }
  StandAlone(&self);
  for (pollfd ended{self, POLLIN, 0}; ::poll(&ended, 1, -1) < 0 && errno == EINTR;) {
  }
  if (shared_->done.load(std::memory_order_relaxed)) {
    std::fprintf(stderr,
                 "fulcrum: the supervisor (pid %d) was killed after session %s had ended: what it was still writing, "
                 "the report or the video, is missing\n",
                 static_cast<int>(supervisor), folder_.session_id.c_str());
    ::_exit(0);
  }
  shared_->KillChildren();
  const int files = Remove(domain_, memory_, folder_);
  std::fprintf(stderr,
               "fulcrum: the supervisor (pid %d) was killed: session %s is over without a report; its processes were "
               "ended, %d files of shared memory removed\n",
               static_cast<int>(supervisor), folder_.session_id.c_str(), files);
  ::_exit(0);
}

CrashWatch::~CrashWatch() {
  ::kill(watcher_, SIGKILL);
  ::waitpid(watcher_, nullptr, 0);
  ::munmap(shared_, sizeof(Shared));
  if (done_) return;
  bus::RemoveSharedMemory(memory_);  // This process holds the domain.
  std::error_code ignored;
  if (fs::is_directory(folder_.path, ignored)) RemoveCheckpoints(folder_);
}

void CrashWatch::Note(std::size_t place, pid_t child) noexcept {
  if (place < kMostChildren) shared_->children[place].store(child, std::memory_order_relaxed);
}

void CrashWatch::Done() noexcept {
  done_ = true;
  shared_->done.store(true, std::memory_order_relaxed);
}

void SweepKilledSessions(int own) {
  std::error_code ignored;
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator("/dev/shm", ignored)) folders.push_back(entry.path());
  for (const fs::path& folder : folders) {
    const int domain = DomainOfName(folder.filename());
    if (domain < 0 || domain == own || DomainGuard::IsHeld(domain)) continue;
    try {
      const DomainGuard guard(domain);  // A session that starts there must wait until the folder is clean.
      bus::ClearSharedMemory(folder);
    } catch (const InputError&) {  // A session has just taken it.
    }
  }
}

}  // namespace fulcrum::supervisor
