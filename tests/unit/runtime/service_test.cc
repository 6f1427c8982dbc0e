// Notifications of a process to systemd, and the folders in which it looks for installed files.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "services/base/runtime/install_places.h"
#include "services/base/runtime/service_notify.h"

namespace fulcrum::runtime {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(ProgressTest, NeedsEveryCounterToAdvance) {
  Progress progress;
  EXPECT_TRUE(progress.Advanced({1, 1}));
  EXPECT_FALSE(progress.Advanced({1, 1}));
  EXPECT_FALSE(progress.Advanced({2, 1})) << "the second thread hangs";
  EXPECT_TRUE(progress.Advanced({2, 2})) << "compared with the last time that all had advanced";
  EXPECT_TRUE(progress.Advanced({2, 2, 0})) << "one more thread";
  EXPECT_FALSE(progress.Advanced({3, 3, 0}));
}

/// A socket in place of systemd's, in the environment of this process.
class ServiceNotifyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_ = (std::filesystem::temp_directory_path() / ("fulcrum-notify-" + std::to_string(::getpid()))).string();
    std::memcpy(address.sun_path, path_.data(), path_.size());
    ASSERT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);
    ::setenv("WATCHDOG_USEC", "4000000", 1);
  }
  void TearDown() override {
    ::close(fd_);
    ::unlink(path_.c_str());
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
  }
  std::string Heard() const {
    std::string all;
    std::array<char, 256> text;
    for (ssize_t n = 0; (n = ::recv(fd_, text.data(), text.size(), 0)) > 0;) {
      all.append(text.data(), static_cast<std::size_t>(n)).append("|");
    }
    return all;
  }

 private:
  int fd_ = -1;
  std::string path_;
};

TEST_F(ServiceNotifyTest, TellsReadinessStatusAndEnd) {
  ServiceNotify service;
  EXPECT_EQ(Heard(), "");
  service.Ready();
  EXPECT_EQ(Heard(), "READY=1|");
  service.Update(100 * kSecond, {1}, "waits");
  EXPECT_EQ(Heard(), "WATCHDOG=1|STATUS=waits|");
  service.Update(100 * kSecond + 1, {2}, "runs");
  EXPECT_EQ(Heard(), "") << "a status at most once a second";
  service.Update(101 * kSecond, {3}, "runs");
  EXPECT_EQ(Heard(), "WATCHDOG=1|STATUS=runs|");
  service.Stopping();
  EXPECT_EQ(Heard(), "STOPPING=1|");
}

TEST_F(ServiceNotifyTest, DoesNotFeedTheWatchdogOfAThreadThatHangs) {
  ServiceNotify service;
  service.Update(100 * kSecond, {1, 7}, "");
  EXPECT_EQ(Heard(), "WATCHDOG=1|");
  for (int i = 1; i < 60; ++i) service.Update((100 + i) * kSecond, {1u + static_cast<unsigned>(i), 7}, "");
  EXPECT_EQ(Heard(), "");
  service.Update(161 * kSecond, {99, 8}, "");
  EXPECT_EQ(Heard(), "WATCHDOG=1|") << "at once when the thread continues";
}

TEST_F(ServiceNotifyTest, BeatsFourTimesInTheTimeOfTheWatchdog) {
  ServiceNotify service;
  for (unsigned i = 0; i < 40; ++i) service.Update(100 * kSecond + i * kSecond / 10, {i}, "");
  EXPECT_EQ(Heard(), "WATCHDOG=1|WATCHDOG=1|WATCHDOG=1|WATCHDOG=1|");
}

TEST_F(ServiceNotifyTest, TellsNobodyWhenNobodyAsks) {
  ::unsetenv("NOTIFY_SOCKET");
  ServiceNotify service;
  service.Ready();
  service.Update(100 * kSecond, {1}, "runs");
  service.Stopping();
  EXPECT_EQ(Heard(), "");
}

TEST(InstallPlacesTest, AreFoundFromTheProgramsOfAnyTree) {
  EXPECT_EQ(ShareFolderOf("/usr/libexec/fulcrum"), "/usr/share/fulcrum");
  EXPECT_EQ(MachineCartOf("/usr/libexec/fulcrum"), "/etc/fulcrum/cart.yaml");
  EXPECT_EQ(ShareFolderOf("/tmp/x/usr/libexec/fulcrum"), "/tmp/x/usr/share/fulcrum");
  EXPECT_EQ(MachineCartOf("/tmp/x/usr/libexec/fulcrum"), "/tmp/x/etc/fulcrum/cart.yaml");
  EXPECT_EQ(MachineCartOf("/opt/fulcrum/libexec/fulcrum"), "/opt/fulcrum/etc/fulcrum/cart.yaml");
  EXPECT_EQ(ShareFolderOf("/home/a/build/release/bin"), "/home/a/build/release/share/fulcrum");
  EXPECT_EQ(MachineCartOf("/home/a/build/release/bin"), "") << "a program of a build tree does not read /etc";
}

}  // namespace
}  // namespace fulcrum::runtime
