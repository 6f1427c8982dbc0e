// State after the supervisor of a whole cart is killed.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "services/transport/bus/dds/shared_memory.h"
#include "tests/support/cart.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::Cart;
using testing::Program;
using testing::WaitFor;

constexpr int kDomain = 75, kOtherDomain = 93;
constexpr double kPatience_s = 30;

class Crash : public ::testing::Test {
 protected:
  void SetUp() override {
    // Orphans become children of this process, which reaps them: a zombie would count as a process that is left.
    ASSERT_EQ(::prctl(PR_SET_CHILD_SUBREAPER, 1), 0);
    ASSERT_TRUE(WaitFor(kPatience_s, [&] {
      return cart_.nodes().size() == kProcesses && cart_.PictureTime() > 0 && CheckpointsOf(folder_) >= 2;
    })) << cart_.Said();
    session_ = fs::canonical(cart_.session());
    processes_ = cart_.nodes();
    // A private folder with a key, which later versions may keep there for the session.
    fs::create_directory(memory_ / "private");
    std::ofstream(memory_ / "private" / "key.pem") << "secret";
  }
  void TearDown() override {
    bus::RemoveSharedMemory(memory_);
    ::prctl(PR_SET_CHILD_SUBREAPER, 0);
  }
  static std::size_t CheckpointsOf(const fs::path& folder) {
    std::size_t found = 0;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder, ignored))
      found += entry.path().extension() == ".checkpoint";
    return found;
  }
  [[nodiscard]] bool AllAreGone() const {
    for (const auto& [name, pid] : processes_) {
      (void)::waitpid(pid, nullptr, WNOHANG);
      if (::kill(pid, 0) == 0 || errno != ESRCH) return false;
    }
    return true;
  }

  static constexpr std::size_t kProcesses = 5 + 1 + 2;  // The nodes, the recorder, the picture's spare, crash_watch.
  const fs::path memory_ = bus::SharedMemoryDirectory(kDomain);
  Cart cart_{"small", kDomain, {"--record"}};
  const fs::path folder_ = cart_.session();
  fs::path session_;
  std::map<std::string, pid_t> processes_;
};

TEST_F(Crash, NothingIsLeftOfASessionWhoseSupervisorWasKilled) {
  // A hanging child must be killed, too.
  ::kill(processes_.at("thermal_node"), SIGSTOP);
  cart_.Signal(SIGKILL);
  EXPECT_EQ(cart_.WaitForEnd(kPatience_s), -SIGKILL);
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return AllAreGone(); }));
  EXPECT_FALSE(fs::exists(memory_));
  EXPECT_EQ(CheckpointsOf(session_), 0u);
  EXPECT_TRUE(fs::exists(session_ / "recording.mcap"));
  EXPECT_NE(cart_.Said().find("was killed: session "), std::string::npos) << cart_.Said();
}

TEST_F(Crash, TheNextSessionInAnyDomainSweepsWhatNobodySwept) {
  ::kill(processes_.at("crash_watch"), SIGKILL);
  cart_.Signal(SIGKILL);
  EXPECT_EQ(cart_.WaitForEnd(kPatience_s), -SIGKILL);
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return AllAreGone(); }));
  EXPECT_TRUE(fs::exists(memory_ / "private" / "key.pem")) << "it was removed too early";
  Cart other("small", kOtherDomain, {"--seconds", "0.5"});
  EXPECT_TRUE(other.WaitForEnd(kPatience_s).has_value()) << other.Said();
  EXPECT_FALSE(fs::exists(memory_)) << other.Said();
  EXPECT_FALSE(fs::exists(bus::SharedMemoryDirectory(kOtherDomain)));
}

TEST_F(Crash, TheWatchDoesNotEndWithTheTerminalOrTheSession) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::kill(processes_.at("crash_watch"), signal);
  EXPECT_EQ(cart_.nodes().count("crash_watch"), 1u);
  cart_.Signal(SIGINT);
  EXPECT_TRUE(cart_.WaitForEnd(kPatience_s).has_value());
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return AllAreGone(); }));
  EXPECT_EQ(cart_.Said().find("was killed: session "), std::string::npos) << cart_.Said();
}

}  // namespace
}  // namespace fulcrum
