// Operations that a confined node can still do: a process confines itself as a node does and attempts them.
#include "services/base/runtime/confinement.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "services/transport/bus/dds/shared_memory.h"
#include "tests/support/program.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using Results = std::map<std::string, std::string>;

constexpr int kDomain = 77;
const std::string kDone = "done", kNotPermitted = "Operation not permitted", kDenied = "Permission denied";

class Confinement : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(session_ / "frames");
    fs::create_directories(home_);
    std::ofstream(folder_ / "there") << "x";
  }
  void TearDown() override {
    fs::remove_all(folder_);
    bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
    fs::remove("/dev/shm/confined_node.other");
  }
  /// Results that the process prints, by attempt.
  Results As(const std::string& node) {
    testing::Program program("/usr/bin/env", {"HOME=" + home_.string(), FULCRUM_BIN_DIR "/confined_node", node,
                                              session_, std::to_string(kDomain)});
    EXPECT_EQ(program.End(0), 0) << program.Said();
    Results results;
    std::istringstream lines(program.Said());
    for (std::string line; std::getline(lines, line);) {
      const std::size_t at = line.find(": ");
      if (at != std::string::npos) results[line.substr(0, at)] = line.substr(at + 2);
    }
    return results;
  }

  const fs::path folder_ = fs::temp_directory_path() / ("fulcrum-confinement-" + std::to_string(::getpid()));
  const fs::path session_ = folder_ / "session", home_ = folder_ / "home";
};

TEST_F(Confinement, NoNodeStartsAProgramOrOpensAForeignSocket) {
  for (const char* node :
       {"handle_bridge", "haptics_node", "touch", "physics_node", "thermal_node", "render_node", "recorder"}) {
    SCOPED_TRACE(node);
    Results results = As(node);
    for (const char* refused :
         {"program", "packet socket", "packet socket of a thread", "raw socket", "IPv6 socket", "bluetooth socket",
          "kernel crypto socket", "memory of another process", "mount", "user namespace", "user namespace of a child",
          "key of the kernel", "io_uring", "another user", "clock"}) {
      EXPECT_EQ(results[refused], kNotPermitted) << refused;
    }
    for (const char* needed : {"datagram socket", "local socket", "netlink socket", "own folder of a thread", "thread",
                               "file to read", "shared memory", "no device"}) {
      EXPECT_EQ(results[needed], kDone) << needed;
    }
  }
}

TEST_F(Confinement, ANodeWritesOnlyWhatItMust) {
  if (runtime::LandlockVersion() == 0) GTEST_SKIP() << "this kernel has no Landlock";
  const std::map<std::string, std::vector<std::string>> allowed{{"handle_bridge", {"terminal"}},
                                                                {"haptics_node", {"terminal"}},
                                                                {"physics_node", {"file of the session", "picture"}},
                                                                {"thermal_node", {"file of the session", "picture"}},
                                                                {"render_node", {"picture"}},
                                                                {"recorder", {"file of the session", "picture"}}};
  for (const auto& [node, more] : allowed) {
    SCOPED_TRACE(node);
    Results results = As(node);
    for (const char* attempt : {"file of the home", "file beside the session", "file of the session", "picture",
                                "shared memory of another cart", "terminal", "removal beside the session"}) {
      const bool may = std::find(more.begin(), more.end(), attempt) != more.end();
      EXPECT_EQ(results[attempt], may ? kDone : kDenied) << attempt;
    }
  }
}

}  // namespace
}  // namespace fulcrum
