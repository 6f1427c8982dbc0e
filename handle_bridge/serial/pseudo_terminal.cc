#include "handle_bridge/serial/pseudo_terminal.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

namespace fulcrum::handle_bridge {
namespace {

constexpr std::array<std::pair<int, speed_t>, 8> kSpeeds = {{{9600, B9600},
                                                             {19200, B19200},
                                                             {38400, B38400},
                                                             {57600, B57600},
                                                             {115200, B115200},
                                                             {230400, B230400},
                                                             {460800, B460800},
                                                             {921600, B921600}}};

class TerminalSource final : public ByteSource {
 public:
  TerminalSource(runtime::FileDescriptor fd, std::string unit) : fd_(std::move(fd)), unit_(std::move(unit)) {}

  ReadResult Read(std::span<char> buffer) noexcept override {
    // poll(), and read() without data, wait for the kernel worker that moves bytes into the terminal. The worker has no
    // real-time priority: on a loaded machine this delayed the 400 Hz thread by 70 ms. FIONREAD does not wait, and
    // fails once the other end has hung up.
    int waiting = 0;
    if (::ioctl(fd_.get(), FIONREAD, &waiting) != 0) {
      return {0, true};
    }
    if (waiting <= 0) {
      return {};
    }
    const std::size_t count = std::min(static_cast<std::size_t>(waiting), buffer.size());
    const ssize_t read = ::read(fd_.get(), buffer.data(), count);
    return {static_cast<std::size_t>(std::max<ssize_t>(read, 0)), read < 0 && errno == EIO};
  }

  [[nodiscard]] std::string_view unit() const noexcept override { return unit_; }

 private:
  runtime::FileDescriptor fd_;
  std::string unit_;
};

bool SetRaw(int fd, int baud) {
  termios settings{};
  if (::tcgetattr(fd, &settings) != 0) {
    return false;
  }
  ::cfmakeraw(&settings);
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | PARENB | CRTSCTS);
  settings.c_cflag |= CLOCAL | CREAD | CS8;
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  for (const auto& [known_baud, speed] : kSpeeds) {
    if (known_baud == baud) {
      ::cfsetspeed(&settings, speed);
    }
  }
  return ::tcsetattr(fd, TCSAFLUSH, &settings) == 0;  // Discards bytes received before, as a closed port does.
}

}  // namespace

PseudoTerminal::PseudoTerminal() : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
  std::array<char, 64> name{};
  if (!master_.valid() || ::grantpt(master_.get()) != 0 || ::unlockpt(master_.get()) != 0 ||
      ::ptsname_r(master_.get(), name.data(), name.size()) != 0) {
    throw std::system_error(errno, std::generic_category(), "no pseudo-terminal for the simulated firmware");
  }
  device_ = name.data();
}

std::size_t PseudoTerminal::Send(std::string_view bytes) noexcept {
  const ssize_t sent = ::write(master_.get(), bytes.data(), bytes.size());
  return sent > 0 ? static_cast<std::size_t>(sent) : 0;
}

int PseudoTerminal::ReaderBaud() const noexcept {
  termios settings{};  // On Linux the master shows the settings of the other end.
  if (::tcgetattr(master_.get(), &settings) != 0) {
    return 0;
  }
  for (const auto& [baud, speed] : kSpeeds) {
    if (::cfgetospeed(&settings) == speed) {
      return baud;
    }
  }
  return 0;
}

std::unique_ptr<ByteSource> TerminalOpener::Open(int baud) {
  const std::string device = device_();
  if (device.empty()) {
    return nullptr;
  }
  runtime::FileDescriptor fd(::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd.valid() || !SetRaw(fd.get(), baud)) {
    return nullptr;
  }
  return std::make_unique<TerminalSource>(std::move(fd), unit_);
}

}  // namespace fulcrum::handle_bridge
