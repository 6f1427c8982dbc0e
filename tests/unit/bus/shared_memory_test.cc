#include "services/transport/bus/dds/shared_memory.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "services/base/core/error.h"
#include "services/transport/bus/security.h"

namespace fulcrum::bus {
namespace {

namespace fs = std::filesystem;

class SharedMemory : public testing::Test {
 protected:
  void SetUp() override { fs::remove_all(directory_); }
  void TearDown() override { fs::remove_all(directory_); }
  /// Creates a file with a name as the library gives those of process `pid`.
  fs::path Touch(int pid) {
    char name[120];
    std::snprintf(name, sizeof name, "fast_datasharing_01.0f.12.34.%02x.%02x.56.78.0.0.0.0|0.0.1.3", pid & 0xff,
                  (pid >> 8) & 0xff);
    std::ofstream(directory_ / name) << "payload";
    return directory_ / name;
  }
  const fs::path directory_ = "/dev/shm/fulcrum-test-" + std::to_string(getpid());
};

TEST_F(SharedMemory, DirectoryIsPrivate) {
  PrepareSharedMemory(directory_);
  struct stat status {};
  ASSERT_EQ(stat(directory_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0700u);
  PrepareSharedMemory(directory_);  // for a second process of the cart
}

TEST_F(SharedMemory, DirectoryOpenToOthersIsRefused) {
  fs::create_directory(directory_);
  chmod(directory_.c_str(), 0755);
  EXPECT_THROW(PrepareSharedMemory(directory_), InputError);
}

TEST_F(SharedMemory, LinkIsRefused) {
  fs::create_symlink("/dev/shm", directory_);
  EXPECT_THROW(PrepareSharedMemory(directory_), InputError);
}

TEST_F(SharedMemory, UnreachablePlaceIsRefused) { EXPECT_THROW(PrepareSharedMemory("/nowhere/fulcrum"), InputError); }

TEST_F(SharedMemory, FilesOfThisProcessGetAllOfTheirMemory) {
  PrepareSharedMemory(directory_);
  const auto blocks = [](const fs::path& file) {
    struct stat status {};
    return stat(file.c_str(), &status) == 0 ? status.st_blocks : -1;
  };
  const fs::path own = Touch(getpid()), other = Touch(getpid() ^ 0x0101);
  for (const fs::path& file : {own, other}) fs::resize_file(file, 1 << 20);
  ReserveSharedMemory(directory_);
  EXPECT_GE(blocks(own), (1 << 20) / 512);
  EXPECT_LT(blocks(other), 100);
}

TEST_F(SharedMemory, SweepRemovesOnlyWhatTheDeadLeft) {
  PrepareSharedMemory(directory_);
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);  // so `child` is the id of a dead process
  const fs::path dead = Touch(child), own = Touch(getpid());
  std::ofstream(directory_ / "something_else") << "x";
  const SweepResult swept = SweepSharedMemory(directory_);
  EXPECT_EQ(swept.files, 1);
  EXPECT_FALSE(fs::exists(dead));
  EXPECT_TRUE(fs::exists(own));
  EXPECT_TRUE(fs::exists(directory_ / "something_else"));
}

TEST_F(SharedMemory, SweepKnowsSecuredOwnersByTheirClaims) {
  PrepareSharedMemory(directory_);
  const std::string ours = "9f.01.02.03.04.05.06.07.08.09.0a.0b", theirs = "9f.01.02.03.04.05.aa.bb.cc.dd.ee.ff";
  const auto touch = [this](const std::string& address) {
    std::ofstream(directory_ / ("fast_datasharing_" + address + "|0.0.1.3")) << "payload";
  };
  const pid_t child = fork();
  if (child == 0) {
    ClaimSharedMemory(directory_, theirs);
    _exit(0);
  }
  waitpid(child, nullptr, 0);
  ClaimSharedMemory(directory_, ours);
  touch(ours);
  touch(theirs);
  EXPECT_EQ(SweepSharedMemory(directory_).files, 2) << "the file and the claim of the dead process";
  EXPECT_TRUE(fs::exists(directory_ / ("fast_datasharing_" + ours + "|0.0.1.3")));
  EXPECT_FALSE(fs::exists(directory_ / ("fast_datasharing_" + theirs + "|0.0.1.3")));
}

TEST_F(SharedMemory, TellsHowTheSessionIsSecured) {
  PrepareSharedMemory(directory_);
  EXPECT_FALSE(AnnouncedSecurity(directory_, "fulcrum").on());
  EXPECT_EQ(AnnouncedSession(directory_), 0u);
  const std::uint64_t first = AnnounceSession(directory_, {"/some where/keys", "supervisor", true});
  EXPECT_EQ(AnnouncedSession(directory_), first);
  const Security told = AnnouncedSecurity(directory_, "fulcrum");
  EXPECT_EQ(told.keys, "/some where/keys");
  EXPECT_EQ(told.identity, "fulcrum");
  EXPECT_TRUE(told.encrypt);
  EXPECT_NE(AnnounceSession(directory_, {}), first) << "each session has a number of its own";
  EXPECT_FALSE(AnnouncedSecurity(directory_, "fulcrum").on()) << "the keys of the earlier session are withdrawn";
}

TEST_F(SharedMemory, RemoveTakesAllAndTheDirectory) {
  PrepareSharedMemory(directory_);
  Touch(getpid());
  EXPECT_EQ(RemoveSharedMemory(directory_).files, 1);
  EXPECT_FALSE(fs::exists(directory_));
  EXPECT_EQ(RemoveSharedMemory(directory_).files, 0);
  EXPECT_EQ(SweepSharedMemory(directory_).files, 0);
}

}  // namespace
}  // namespace fulcrum::bus
