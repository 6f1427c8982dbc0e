#include "services/apps/replayer/keyframes.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>

#include "services/base/runtime/realtime.h"

namespace fulcrum::replay {
namespace {

struct Pipe {
  int read = -1, write = -1;
};

Pipe MakePipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  return {ends[0], ends[1]};
}

pid_t Fork() {
  // Parent and child would both write the content of the buffers.
  std::fflush(nullptr);
  const pid_t pid = ::fork();
  if (pid < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  return pid;
}

template <class T>
bool ReadWhole(int file, T* value) {
  ssize_t got = 0;
  do {
    got = ::read(file, value, sizeof(T));
  } while (got < 0 && errno == EINTR);
  return got == static_cast<ssize_t>(sizeof(T));
}

constexpr int kRunning = 0, kEnded = 1;
struct News {
  int kind;  ///< kRunning: process `value` continues the replay; kEnded: it has ended with exit code `value`.
  int value;
};
// Longest time from the end of a process to the first message of the process that it has woken [ms].
constexpr int kHandover_ms = 2000;

/// Exit code of the replay; 1 when the running process died without sending one, and after SIGINT or SIGTERM, which
/// ends the running process, too. The running process is watched through a pidfd, because the sleeping ones keep the
/// pipe open after its death.
int AwaitVerdict(int pipe) {
  int running = -1;
  int code = 1;
  bool died = false;
  for (;;) {
    std::array<pollfd, 2> waits{{{pipe, POLLIN, 0}, {died ? -1 : running, POLLIN, 0}}};
    const int ready = ::poll(waits.data(), waits.size(), died ? kHandover_ms : -1);
    if (runtime::ShouldStop()) {
      if (running >= 0) (void)::syscall(SYS_pidfd_send_signal, running, SIGTERM, nullptr, 0);
      break;
    }
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) break;
    if (waits[0].revents != 0) {
      News news{};
      if (!ReadWhole(pipe, &news)) break;
      if (news.kind == kEnded) {
        code = news.value;
        break;
      }
      if (running >= 0) ::close(running);
      running = static_cast<int>(::syscall(SYS_pidfd_open, news.value, 0));
      died = running < 0;
    } else {
      died = true;
    }
  }
  if (running >= 0) ::close(running);
  return code;
}

}  // namespace

int Keyframes::Run(const std::function<int(Keyframes*)>& body) {
  const Pipe lifeline = MakePipe(), verdict = MakePipe();
  const pid_t first = Fork();
  if (first == 0) {
    ::close(lifeline.write);
    ::close(verdict.read);
    // With SIGCHLD ignored, the kernel reaps ended keyframe processes.
    ::signal(SIGCHLD, SIG_IGN);
    ::signal(SIGPIPE, SIG_IGN);
    Keyframes keyframes(lifeline.read, verdict.write);
    keyframes.Tell(kRunning, ::getpid());
    const int code = body(&keyframes);
    std::fflush(nullptr);
    keyframes.Tell(kEnded, code);
    ::_exit(0);
  }
  ::close(lifeline.read);
  ::close(verdict.write);
  // Only here: the processes of the replay die of a signal, and the caller removes what they have left.
  runtime::InstallStopSignals();
  const int code = AwaitVerdict(verdict.read);
  ::close(verdict.read);
  ::close(lifeline.write);  // All sleeping keyframes end.
  if (runtime::ShouldStop()) ::kill(first, SIGTERM);
  int status = 0;
  while (::waitpid(first, &status, 0) < 0 && errno == EINTR) {
  }
  return code;
}

void Keyframes::Tell(int kind, int value) const {
  const News news{kind, value};
  (void)!::write(verdict_, &news, sizeof(news));
}

std::optional<double> Keyframes::Keep(double time_s) {
  if (!kept_.empty() && time_s < kept_.back().time_s + spacing_s_) return std::nullopt;
  if (kept_.size() == kMost) {
    for (std::size_t i = 1; i < kept_.size(); i += 2) {
      // Closing the pipe is not enough, because other sleeping processes also have its write end open.
      const double end = std::numeric_limits<double>::quiet_NaN();
      (void)!::write(kept_[i].wake, &end, sizeof(end));
      ::close(kept_[i].wake);
    }
    std::vector<Keyframe> left;
    for (std::size_t i = 0; i < kept_.size(); i += 2) left.push_back(kept_[i]);
    kept_ = std::move(left);
    spacing_s_ *= 2;
  }
  const Pipe wake = MakePipe();
  pid_t pid = Fork();
  if (pid != 0) {
    ::close(wake.read);
    kept_.push_back({time_s, wake.write});
    return std::nullopt;
  }
  for (;;) {
    std::array<pollfd, 2> waits{{{wake.read, POLLIN, 0}, {lifeline_, POLLIN, 0}}};
    if (::poll(waits.data(), waits.size(), -1) < 0 && errno == EINTR) continue;
    double wanted_s = 0;
    if (waits[1].revents != 0 || !ReadWhole(wake.read, &wanted_s) || std::isnan(wanted_s)) ::_exit(0);
    // The new copy continues the replay; this process stays as the keyframe.
    pid = Fork();
    if (pid == 0) {
      ::close(wake.read);
      kept_.push_back({time_s, wake.write});
      Tell(kRunning, ::getpid());
      return wanted_s;
    }
  }
}

void Keyframes::GoBack(double time_s) {
  std::fflush(nullptr);
  for (auto k = kept_.rbegin(); k != kept_.rend(); ++k) {
    // Writing fails when a later process has removed this keyframe.
    if (k->time_s <= time_s && ::write(k->wake, &time_s, sizeof(time_s)) == sizeof(time_s)) ::_exit(0);
  }
}

}  // namespace fulcrum::replay
