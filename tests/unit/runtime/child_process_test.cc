#include "services/base/runtime/child_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>

namespace fulcrum::runtime {
namespace {

TEST(ChildProcess, InheritsNoOpenFileOfItsParent) {
  std::string folder = (std::filesystem::temp_directory_path() / "fulcrum_child_process_XXXXXX").string();
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  const std::filesystem::path log = folder + "/log", secret = folder + "/open-in-the-parent";
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
  std::filesystem::remove_all(folder);
  EXPECT_NE(listed.find(log.filename().string()), std::string::npos) << listed;
  EXPECT_EQ(listed.find(secret.filename().string()), std::string::npos) << listed;
}

}  // namespace
}  // namespace fulcrum::runtime
