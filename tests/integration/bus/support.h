// Helpers of the bus tests: waiting for a condition, and a second process as peer.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"

namespace fulcrum::bus::test {

/// Waits for a condition that must become true; these tests do not check the time that it takes.
template <class Condition>
bool Eventually(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

/// The program bus_test_peer with the given arguments; killed at the end of its scope and with its parent.
class Peer {
 public:
  explicit Peer(const std::vector<std::string>& arguments) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    const std::string program = std::string(FULCRUM_BIN_DIR) + "/bus_test_peer";
    std::vector<char*> argv{const_cast<char*>(program.c_str())};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      dup2(ends[1], STDOUT_FILENO);
      execv(program.c_str(), argv.data());
      _exit(127);
    }
    close(ends[1]);
    output_ = ends[0];
  }
  ~Peer() {
    Kill();
    close(output_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }

  /// Next line that it prints; empty at its end.
  std::string ReadLine() {
    std::string line;
    char c = 0;
    while (read(output_, &c, 1) == 1 && c != '\n') line += c;
    return line;
  }

  /// Kills the process with SIGKILL and waits for its end.
  void Kill() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }

 private:
  pid_t pid_ = -1;
  int output_ = -1;
};

/// Removes all files of a test's domain from /dev/shm.
class CleanDomain : public testing::Environment {
 public:
  explicit CleanDomain(int domain) : domain_(domain) {}
  void SetUp() override { RemoveSharedMemory(SharedMemoryDirectory(domain_)); }
  void TearDown() override { RemoveSharedMemory(SharedMemoryDirectory(domain_)); }

 private:
  int domain_;
};

}  // namespace fulcrum::bus::test
