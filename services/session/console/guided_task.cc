#include "services/session/console/guided_task.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "services/base/core/error.h"

namespace fulcrum::console {
namespace {

constexpr std::int64_t kPatience_ns = 3'000'000'000;

/// Both sides of a pseudo-terminal without echo; closed at the end of the scope unless taken.
class Terminal {
 public:
  Terminal() : ours_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK)) {
    std::array<char, 128> name{};
    const bool open = ours_ >= 0 && ::grantpt(ours_) == 0 && ::unlockpt(ours_) == 0 &&
                      ::ptsname_r(ours_, name.data(), name.size()) == 0;
    theirs_ = open ? ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC) : -1;
    termios settings{};
    if (theirs_ < 0 || ::tcgetattr(theirs_, &settings) != 0) {
      const int error = errno;
      Close();
      throw InputError(std::string("no pseudo-terminal for the task: ") + ::strerror(error));
    }
    settings.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    settings.c_oflag &= ~static_cast<tcflag_t>(ONLCR);
    ::tcsetattr(theirs_, TCSANOW, &settings);
    const winsize size{.ws_row = 40, .ws_col = 90, .ws_xpixel = 0, .ws_ypixel = 0};
    ::ioctl(theirs_, TIOCSWINSZ, &size);
  }
  ~Terminal() { Close(); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  [[nodiscard]] int theirs() const { return theirs_; }
  [[nodiscard]] int TakeOurs() { return std::exchange(ours_, -1); }

 private:
  void Close() const {
    if (ours_ >= 0) ::close(ours_);
    if (theirs_ >= 0) ::close(theirs_);
  }
  int ours_, theirs_ = -1;
};

}  // namespace

GuidedTask::GuidedTask(std::string title, const std::filesystem::path& program,
                       const std::vector<std::string>& arguments)
    : title_(std::move(title)) {
  Terminal terminal;
  process_ = runtime::ChildProcess::StartOn(program, arguments, {terminal.theirs(), terminal.theirs()});
  terminal_ = terminal.TakeOurs();
}

GuidedTask::~GuidedTask() { ::close(terminal_); }

bool GuidedTask::Read() {
  bool any = false;
  std::array<char, 4096> bytes;
  for (ssize_t n = 0; (n = ::read(terminal_, bytes.data(), bytes.size())) > 0;) {
    screen_.Add({bytes.data(), static_cast<std::size_t>(n)});
    any = true;
  }
  return any;
}

bool GuidedTask::Poll(std::int64_t now_ns) {
  if (!process_.running()) return false;
  bool changed = false;
  // The end is polled before the output, so that all output of an ended program is read.
  if (const auto end = process_.Poll()) {
    end_ = end;
    changed = true;
  }
  changed |= Read();
  if (kill_ns_ != 0 && now_ns >= kill_ns_) process_.Signal(SIGKILL);
  return changed;
}

void GuidedTask::Enter() {
  if (running()) [[maybe_unused]]
    const ssize_t written = ::write(terminal_, "\n", 1);
}

void GuidedTask::Cancel(std::int64_t now_ns) {
  if (!running()) return;
  process_.Signal(SIGINT);
  if (kill_ns_ == 0) kill_ns_ = now_ns + kPatience_ns;
}

bool GuidedTask::wants_enter() const { return running() && screen_.last().find("press Enter") != std::string::npos; }

}  // namespace fulcrum::console
