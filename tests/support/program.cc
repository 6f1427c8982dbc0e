#include "tests/support/program.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace fulcrum::testing {

Program::Program(const std::string& name, const std::vector<std::string>& arguments, const std::string& input) {
  const int in = ::memfd_create("input", MFD_CLOEXEC);
  output_ = ::memfd_create("output", MFD_CLOEXEC);
  if (in < 0 || output_ < 0 || ::pwrite(in, input.data(), input.size(), 0) != static_cast<ssize_t>(input.size())) {
    throw std::runtime_error("no memory for the input and output of " + name);
  }
  const std::string program = std::filesystem::path(FULCRUM_BIN_DIR) / name;
  std::vector<char*> words{const_cast<char*>(name.c_str())};
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::dup2(in, STDIN_FILENO);
    ::dup2(output_, STDOUT_FILENO);
    ::dup2(output_, STDERR_FILENO);
    ::execv(program.c_str(), words.data());
    ::_exit(127);
  }
  ::close(in);
}

Program::~Program() {
  End(SIGKILL);
  if (output_ >= 0) ::close(output_);
}

Program::Program(Program&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), output_(std::exchange(other.output_, -1)) {}

Program& Program::operator=(Program&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(output_, other.output_);
  return *this;
}

std::string Program::Said() const {
  std::string text;
  std::array<char, 4096> part;
  // pread, because the file offset is shared with the child, which writes at it.
  for (ssize_t n = 0; (n = ::pread(output_, part.data(), part.size(), static_cast<off_t>(text.size()))) > 0;) {
    text.append(part.data(), static_cast<std::size_t>(n));
  }
  return text;
}

void Program::Signal(int signal) const {
  if (pid_ > 0) ::kill(pid_, signal);
}

int Program::Ended(int status) {
  pid_ = -1;
  return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

int Program::End(int signal) {
  if (pid_ <= 0) return 0;
  if (signal != 0) Signal(signal);
  int status = 0;
  ::waitpid(pid_, &status, 0);
  return Ended(status);
}

std::optional<int> Program::Poll() {
  int status = 0;
  if (pid_ <= 0 || ::waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  return Ended(status);
}

}  // namespace fulcrum::testing
