// A whole cart whose processes run out of descriptors or memory, or are stopped.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/support/cart.h"

namespace fulcrum {
namespace {

using testing::Cart;
using testing::Program;
using testing::WaitFor;

constexpr int kDomain = 78;
constexpr double kPatience_s = 30;

class Shortage : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(WaitFor(kPatience_s, [&] { return cart_.PictureTime() > 0; })) << cart_.Said();
  }
  /// A low limit of the supervisor, inherited by the nodes that it starts meanwhile.
  class Limit {
   public:
    Limit(pid_t pid, __rlimit_resource resource, rlim_t soft) : pid_(pid), resource_(resource) {
      ::prlimit(pid_, resource_, nullptr, &before_);
      const rlimit low{soft, before_.rlim_max};
      EXPECT_EQ(::prlimit(pid_, resource_, &low, nullptr), 0);
    }
    ~Limit() { ::prlimit(pid_, resource_, &before_, nullptr); }
    Limit(const Limit&) = delete;
    Limit& operator=(const Limit&) = delete;

   private:
    pid_t pid_;
    __rlimit_resource resource_;
    rlimit before_{};
  };
  pid_t Node(const std::string& name) { return cart_.nodes()[name]; }
  void ExpectTheNodeIsBackAndTheSessionEnds(const std::string& name, pid_t killed) {
    EXPECT_TRUE(WaitFor(kPatience_s, [&] {
      const pid_t now = Node(name);
      return now > 0 && now != killed;
    })) << cart_.Said();
    const double then_s = cart_.PictureTime();
    EXPECT_TRUE(WaitFor(kPatience_s, [&] { return cart_.PictureTime() > then_s; })) << cart_.Said();
    EXPECT_EQ(cart_.Said().find("for good"), std::string::npos) << cart_.Said();
    cart_.Signal(SIGINT);
    EXPECT_GE(cart_.WaitForEnd(kPatience_s).value_or(-1), 0) << cart_.Said();
  }
  bool Says(const std::string& words) {
    return WaitFor(kPatience_s, [&] { return cart_.Said().find(words) != std::string::npos; });
  }

  Cart cart_{"small", kDomain, {"--record", "--seconds", "300", "--allow-swap-command"}};
};

TEST(ShortageAtStart, TooFewFilesAreRefusedWithLimitAndNeed) {
  Program up("/bin/sh", {"-c", "ulimit -n 40; exec " FULCRUM_BIN_DIR "/fulcrum up small --domain 78"});
  EXPECT_EQ(up.End(0), 2) << up.Said();
  EXPECT_NE(up.Said().find("open files: a process of this user may have 40, at least 128 are needed"),
            std::string::npos)
      << up.Said();
}

TEST_F(Shortage, WithoutDescriptorsTheSupervisorKeepsTheSessionAndStartsTheNodeLater) {
  const pid_t victim = Node("thermal_node");
  ASSERT_GT(victim, 0);
  {
    const Limit limit(cart_.pid(), RLIMIT_NOFILE, 5);
    ::kill(victim, SIGKILL);
    EXPECT_TRUE(Says("thermal_node could not be started (cannot write ")) << cart_.Said();
    EXPECT_TRUE(Says("Too many open files")) << cart_.Said();
  }
  ExpectTheNodeIsBackAndTheSessionEnds("thermal_node", victim);
}

TEST_F(Shortage, ANodeWithoutMemoryEndsWithALineAndIsStartedAgain) {
  // The limit is of one start of the node alone: inherited from the supervisor, it would end the supervisor as well.
  // 64 MiB are enough for the program, not for its threads and grids.
  const auto build = cart_.session() / "thermal_node", once = cart_.session() / "short_of_memory";
  std::ofstream(build) << "#!/bin/sh\nif rm " << once << " 2>/dev/null; then ulimit -Sv 65536; fi\n"
                       << "exec " FULCRUM_BIN_DIR "/thermal_node \"$@\"\n";
  std::filesystem::permissions(build, std::filesystem::perms::owner_all);
  const pid_t first = Node("thermal_node");
  ASSERT_GT(first, 0);
  Program swap("fulcrum", {"swap", "thermal_node", "--with", build, "--domain", std::to_string(kDomain)});
  ASSERT_EQ(swap.End(0), 0) << swap.Said();
  // A replacement that ends before it has reported gives way to the program before it.
  const auto reported = [&] {
    Program status("fulcrum", {"status", "--domain", std::to_string(kDomain)});
    status.End(0);
    const pid_t now = Node("thermal_node");
    return now > 0 && now != first && status.Said().find(" " + std::to_string(now) + " ") != std::string::npos;
  };
  ASSERT_TRUE(WaitFor(kPatience_s, reported)) << cart_.Said();
  const pid_t victim = Node("thermal_node");
  const auto log = [&] { return testing::ReadFile(cart_.session() / "logs" / "thermal_node.log"); };
  std::ofstream{once};
  ::kill(victim, SIGKILL);
  EXPECT_TRUE(WaitFor(kPatience_s,
                      [&] {
                        // From a thread of the bus, or from the node itself.
                        return log().find("address space is limited to 64 MiB") != std::string::npos ||
                               log().find("out of memory") != std::string::npos ||
                               // Fast DDS 2.9.1, when one of its threads cannot start while a participant is made.
                               log().find("Assertion `mInputSockets.size() == 0' failed") != std::string::npos;
                      }))
      << cart_.Said() << log();
  EXPECT_FALSE(std::filesystem::exists(once)) << "the limit was not set";
  ExpectTheNodeIsBackAndTheSessionEnds("thermal_node", victim);
}

TEST_F(Shortage, AStoppedSupervisorOrRecorderRestartsNothing) {
  // A spare for the picture is started when the picture has run for a while.
  const auto nodes = [&] {
    auto all = cart_.nodes();
    all.erase("render_spare");
    return all;
  };
  const auto before = nodes();
  const auto stop = [](pid_t pid, std::chrono::seconds time) {
    ::kill(pid, SIGSTOP);
    std::this_thread::sleep_for(time);
    ::kill(pid, SIGCONT);
  };
  // Longer than the silence after which a node is killed, and than the lease of the bus.
  stop(cart_.pid(), std::chrono::seconds(9));
  stop(before.at("recorder"), std::chrono::seconds(3));
  const double then_s = cart_.PictureTime();
  EXPECT_TRUE(WaitFor(kPatience_s, [&] { return cart_.PictureTime() > then_s + 1; })) << cart_.Said();
  EXPECT_EQ(nodes(), before) << cart_.Said();
  EXPECT_EQ(cart_.Said().find("starting it again"), std::string::npos) << cart_.Said();
  cart_.Signal(SIGINT);
  EXPECT_GE(cart_.WaitForEnd(kPatience_s).value_or(-1), 0) << cart_.Said();
}

}  // namespace
}  // namespace fulcrum
