// Options and output of the command `fulcrum` where no session runs.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "services/base/config/cart.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/session/supervisor/session_folder.h"
#include "tests/support/program.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;
using fulcrum::testing::Program;
using Words = std::vector<std::string>;

constexpr int kDomain = 80;

class CommandsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "fulcrum_commands_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    cart_ = folder_ / "cart.yaml";
    WriteFile(cart_, "name: bench\ndomain: " + std::to_string(kDomain) + "\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Runs the command to its end; its exit code, its output is in said_.
  int Run(const Words& words, const std::string& program = "fulcrum") {
    Program command(program, words);
    const int code = command.End(0);
    said_ = command.Said();
    return code;
  }
  [[nodiscard]] bool Said(const std::string& text) const { return said_.find(text) != std::string::npos; }

  fs::path folder_, cart_;
  std::string said_;
};

TEST_F(CommandsTest, WhatServesASessionLooksInTheDomainOfTheMachinesCart) {
  const fs::path program = folder_ / "libexec" / "fulcrum" / "fulcrum";
  fs::create_directories(program.parent_path());
  fs::create_directories(folder_ / "etc" / "fulcrum");
  fs::copy_file(FULCRUM_BIN_DIR "/fulcrum", program);
  fs::copy_file(cart_, folder_ / "etc" / "fulcrum" / "cart.yaml");
  for (Words words : {Words{"status"}, Words{"top"}, Words{"down"}, Words{"dump"}, Words{"restart", "physics_node"},
                      Words{"swap", "physics_node", "--build", "x"}, Words{"generator", "--cut", "30"},
                      Words{"keys", "issue", "some_tool", "--read", "Health"}}) {
    EXPECT_NE(Run(words, program), 0) << words[0];
    EXPECT_TRUE(Said("domain 80")) << words[0] << ": " << said_;
    words.insert(words.end(), {"--domain", "88"});
    EXPECT_NE(Run(words, program), 0) << words[0];
    EXPECT_TRUE(Said("domain 88")) << words[0] << ": " << said_;
  }
}

TEST_F(CommandsTest, AHostWaitsInTheDomainOfItsCartFile) {
  ASSERT_FALSE(DomainGuard::IsHeld(kDomain));
  Program host("fulcrum", {"host", "--peer", "127.0.0.1", "--address", "127.0.0.1", "--insecure-link", "--cart",
                           cart_.string(), "--out", folder_.string()});
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!DomainGuard::IsHeld(kDomain) && !host.Poll() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_TRUE(DomainGuard::IsHeld(kDomain)) << host.Said();
  host.End(SIGTERM);
}

// Two ends that run as different users have different domains of their own, but must meet.
TEST_F(CommandsTest, TheLinkDomainDependsOnGivenDomainsAndNotOnTheUser) {
  const fs::path unnamed = folder_ / "unnamed.yaml";
  WriteFile(unnamed, "name: bench\n");
  const int own = config::DefaultDomain();
  const struct {
    Words words;
    int domain;
    const char* link_domain;
  } cases[] = {{{"--cart", unnamed.string()}, own, "101"},
               {{"--cart", cart_.string()}, kDomain, "180"},
               {{"--cart", unnamed.string(), "--domain", "80"}, kDomain, "180"},
               {{"--cart", cart_.string(), "--link-domain", "123"}, kDomain, "123"}};
  for (const auto& [words, domain, link_domain] : cases) {
    if (DomainGuard::IsHeld(domain)) continue;  // A session of this user runs there.
    Words all{"host", "--peer", "127.0.0.1", "--address", "127.0.0.1", "--insecure-link", "--out", folder_.string()};
    all.insert(all.end(), words.begin(), words.end());
    Program host("fulcrum", all);
    const std::string expected = std::string("in link domain ") + link_domain + "\n";
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (host.Said().find(expected) == std::string::npos && !host.Poll() && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    EXPECT_NE(host.Said().find(expected), std::string::npos) << host.Said();
    host.End(SIGTERM);
  }
}

TEST_F(CommandsTest, HandsInABrowserAreSentToTheMachineThatDrawsThePicture) {
  const DomainGuard taken(kDomain);  // `up` ends before it starts a node.
  EXPECT_EQ(Run({"up", "small", "--hands", "browser", "--peer", "127.0.0.1", "--address", "127.0.0.1", "--remote",
                 "physics_node,render_node", "--insecure-link", "--cart", cart_.string(), "--out", folder_.string()}),
            2);
  EXPECT_TRUE(Said("open the page of fulcrum console on 127.0.0.1")) << said_;
  EXPECT_FALSE(Said("fulcrum console --domain")) << said_;
}

TEST_F(CommandsTest, OptionsOfTheLinkNeedAPeer) {
  for (const Words& option : {Words{"--address", "127.0.0.1"}, Words{"--link-domain", "120"}, Words{"--insecure-link"},
                              Words{"--keys", folder_.string()}}) {
    Words words{"up", "small", "--seconds", "0.1", "--out", folder_.string(), "--cart", cart_.string()};
    words.insert(words.end(), option.begin(), option.end());
    EXPECT_EQ(Run(words), 2);
    EXPECT_TRUE(Said(option[0] + " is about the link to another host and goes with --peer")) << said_;
  }
}

TEST_F(CommandsTest, WhatASceneCommandWouldDropIsRefused) {
  const std::string yaml = folder_ / "s.yaml", out = folder_ / "s.fulcrum";
  const struct {
    Words words;
    const char* expected;
  } cases[] = {
      {{"scene", "new", "l", "--from", "l.obj", "--set", "physics.grip_force_N=3"},
       "--set cannot be combined with --new"},
      {{"scene", "new", "l", "--from", "l.obj", "--check"}, "--check cannot be combined with --new"},
      {{"scene", "new", "l", "--from", "l.obj", "--data", "d"}, "--data cannot be combined with --new"},
      {{"scene", "new", "l", "--from", "l.obj", "--preview", "p.png"}, "--preview cannot be combined with --new"},
      {{"scene", "check", "small", "--out", out}, "--check writes no scene"},
      {{"scene", "check", "small", "--unit", "mm"}, "--unit cannot be combined with SCENE.yaml; it goes with --new"},
      {{"scene", "check", "small", "large"}, "'large' is one word too many"},
      {{"import-anatomy", "l.nii", "--out", "d"}, "--out goes with --map"},
      {{"import-anatomy", "l.nii", "--set", "physics.grip_force_N=3"}, "--set cannot be combined with --anatomy"},
      {{"import-anatomy", "l.nii", "--at", "1,2,3"}, "--at cannot be combined with --anatomy"},
      {{"import-anatomy", "l.nii", "m.nii"}, "'m.nii' is one word too many"},
  };
  for (const auto& [words, expected] : cases) {
    EXPECT_EQ(Run(words), 2) << expected;
    EXPECT_TRUE(Said(expected)) << expected << '\n' << said_;
  }
  EXPECT_EQ(Run({"--info", out, "--set", "a.b=1"}, "scene_compiler"), 2);
  EXPECT_TRUE(Said("--set cannot be combined with --info")) << said_;
  EXPECT_EQ(Run({"--info", out, "--source", out}, "scene_compiler"), 2);
  EXPECT_TRUE(Said("--info cannot be combined with --source")) << said_;
  EXPECT_FALSE(fs::exists(out));
  EXPECT_EQ(Run({"scene", "list", folder_.string()}), 0) << "a folder without a scene";
}

TEST_F(CommandsTest, TheDoctorReadsTheCartFileThatIsGiven) {
  (void)Run({"doctor", "--out", folder_.string(), "--cart", cart_.string()});
  EXPECT_TRUE(Said("✓ cart                " + cart_.string() + ", \"bench\"")) << said_;
  EXPECT_TRUE(Said("domain 80")) << said_;
  WriteFile(cart_, "domain: 500\n");
  EXPECT_EQ(Run({"doctor", "--out", folder_.string(), "--cart", cart_.string()}), 1);
  EXPECT_TRUE(Said("✗ cart")) << said_;
  fs::remove(cart_);
  EXPECT_EQ(Run({"doctor", "--out", folder_.string(), "--cart", cart_.string()}), 1);
  EXPECT_TRUE(Said("✗ cart")) << said_;
}

TEST_F(CommandsTest, TheDoctorNamesTheHardwareOfTheCartThatIsNotThere) {
  EXPECT_EQ(Run({"doctor", "--out", folder_.string(), "--cart", FULCRUM_SOURCE_DIR "/deploy/carts/lab.yaml"}), 1);
  EXPECT_TRUE(Said("✗ serial ports")) << said_;
  for (const char* line : {"handles.tool0: /dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0-port0",
                           "handles.tool1: /dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0",
                           "pedal: /dev/serial/by-path/pci-0000:00:14.0-usb-0:3:1.0-port0"}) {
    EXPECT_TRUE(Said(line)) << line << "\n" << said_;
  }
  (void)Run({"doctor", "--out", folder_.string(), "--cart", FULCRUM_SOURCE_DIR "/deploy/carts/touch.yaml"});
  EXPECT_TRUE(Said("✗ haptic driver       libHD.so is missing") || Said("libHD.so is installed")) << said_;
  (void)Run({"doctor", "--out", folder_.string(), "--cart", cart_.string()});
  EXPECT_TRUE(Said("✓ serial ports")) << said_;
  EXPECT_TRUE(Said("✓ haptic driver")) << said_;
}

// The services run as another user than the technician.
TEST_F(CommandsTest, AnotherUsersSessionIsNamed) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  constexpr int kOtherDomain = 98;
  constexpr uid_t kNobody = 65534;
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t holder = ::fork();
  if (holder == 0) {
    if (::setresuid(kNobody, kNobody, kNobody) != 0) ::_exit(1);
    const DomainGuard guard(kOtherDomain);
    (void)!::write(ready[1], "x", 1);
    for (;;) ::pause();
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  const std::string pid = "pid " + std::to_string(holder) + "): sudo -u ";
  for (const Words& words : {Words{"status"}, Words{"top"}, Words{"doctor", "--out", folder_.string()}}) {
    Words all = words;
    all.insert(all.end(), {"--domain", std::to_string(kOtherDomain)});
    const int code = Run(all);
    EXPECT_TRUE(Said("another user's session runs in domain 98 (")) << words[0] << ": " << said_;
    EXPECT_TRUE(Said(pid)) << words[0] << ": " << said_;
    EXPECT_TRUE(code != 0 || words[0] == "doctor") << words[0];
    EXPECT_FALSE(Said("✗ domain")) << said_;
  }
  ::kill(holder, SIGKILL);
  ::waitpid(holder, nullptr, 0);
  ::close(ready[0]);
  ::close(ready[1]);
}

TEST_F(CommandsTest, TheDoctorJudgesSocketsAsTheBusMakesThem) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int size = 4 << 20;
  const bool may = ::setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size) == 0;
  ::close(socket);
  if (!may) GTEST_SKIP() << "this user may not pass the limit of socket buffers";
  (void)Run({"doctor", "--out", folder_.string()});
  EXPECT_TRUE(Said("✓ socket buffers")) << said_;
}

TEST_F(CommandsTest, WaylandAloneIsNoDisplayForTheWindow) {
  ::unsetenv("DISPLAY");
  ::setenv("WAYLAND_DISPLAY", "wayland-0", 1);
  (void)Run({"doctor", "--out", folder_.string()});
  EXPECT_TRUE(Said("✓ display             none: pictures are drawn off screen")) << said_;
  ::unsetenv("WAYLAND_DISPLAY");
}

// In these lines of the shell $0 is the command.
TEST_F(CommandsTest, OutputThatCannotBeWrittenIsAFailure) {
  const std::string program = FULCRUM_BIN_DIR "/fulcrum";
  EXPECT_EQ(Run({"-c", "$0 help >/dev/full", program}, "/bin/bash"), 1);
  EXPECT_TRUE(Said("the output could not be written")) << said_;
  EXPECT_EQ(Run({"-c", "$0 reference cart " FULCRUM_SOURCE_DIR "/deploy/carts/simulated.yaml >/dev/full", program},
                "/bin/bash"),
            1);
  EXPECT_EQ(Run({"-c", "$0 help | true; exit ${PIPESTATUS[0]}", program}, "/bin/bash"), 0) << said_;
}

TEST_F(CommandsTest, WhatPrintsWithoutEndEndsWithItsReader) {
  const std::string program = FULCRUM_BIN_DIR "/fulcrum";
  EXPECT_EQ(Run({"-c", "timeout 20 $0 inputs --watch --json | head -n 1; exit ${PIPESTATUS[0]}", program}, "/bin/bash"),
            0)
      << said_;
  EXPECT_EQ(Run({"-c", "timeout 20 $0 inputs --watch >/dev/full", program}, "/bin/bash"), 1) << said_;
}

}  // namespace
}  // namespace fulcrum::supervisor
