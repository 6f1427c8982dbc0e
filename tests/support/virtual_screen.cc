#include "tests/support/virtual_screen.h"

#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

namespace fulcrum::testing {
namespace {

constexpr int kNoProgram = 127;

bool Answers(int number) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::snprintf(address.sun_path, sizeof(address.sun_path), "/tmp/.X11-unix/X%d", number);
  const int server = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool answers = ::connect(server, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  ::close(server);
  return answers;
}

}  // namespace

VirtualScreen::VirtualScreen(const std::string& size) {
  for (int attempt = 0; attempt < 5 && display_.empty() && installed_; ++attempt) {
    const int number = 100 + (::getpid() + 97 * attempt) % 800;
    child_ = ::fork();
    if (child_ == 0) {
      const std::string name = ":" + std::to_string(number), screen = size + "x24";
      if (std::freopen("/dev/null", "w", stderr) == nullptr) ::_exit(kNoProgram);
      ::execlp("Xvfb", "Xvfb", name.c_str(), "-screen", "0", screen.c_str(), "-nolisten", "tcp", "-noreset", nullptr);
      ::_exit(kNoProgram);
    }
    Await(number);
  }
}

VirtualScreen::~VirtualScreen() {
  if (child_ <= 0) return;
  ::kill(child_, SIGTERM);
  ::waitpid(child_, nullptr, 0);
}

void VirtualScreen::Await(int number) {
  for (int wait = 0; wait < 1000; ++wait) {
    int status = 0;
    if (::waitpid(child_, &status, WNOHANG) == child_) {
      installed_ = !(WIFEXITED(status) && WEXITSTATUS(status) == kNoProgram);
      child_ = -1;
      return;
    }
    if (Answers(number)) {
      display_ = ":" + std::to_string(number);
      return;
    }
    ::usleep(10'000);
  }
  ::kill(child_, SIGKILL);
  ::waitpid(child_, nullptr, 0);
  child_ = -1;
}

}  // namespace fulcrum::testing
