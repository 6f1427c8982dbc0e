#include "services/session/supervisor/child_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>

#include "tests/unit/supervisor/temporary_folder.h"

namespace fulcrum::supervisor {
namespace {

TEST(ChildProcess, InheritsNoOpenFileOfItsParent) {
  const TemporaryFolder folder;
  const std::filesystem::path log = folder.path() / "log", secret = folder.path() / "open-in-the-parent";
  // Opened like the sockets of the bus: without O_CLOEXEC.
  const int fd = ::open(secret.c_str(), O_RDWR | O_CREAT, 0600);
  ASSERT_GE(fd, 0);
  ChildProcess child = ChildProcess::Start("/bin/ls", {"-l", "/proc/self/fd"}, log);
  std::optional<ProcessEnd> end;
  while (!(end = child.Poll())) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ::close(fd);
  EXPECT_EQ(end->exit_code, 0);
  std::ifstream stream(log);
  const std::string listed{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_NE(listed.find(log.filename().string()), std::string::npos) << listed;
  EXPECT_EQ(listed.find(secret.filename().string()), std::string::npos) << listed;
}

}  // namespace
}  // namespace fulcrum::supervisor
