// fulcrum doctor --security: its report on a machine, on keys and on a running session.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

#include "services/transport/bus/dds/shared_memory.h"
#include "tests/support/cart.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::Program;

constexpr int kDomain = 79;

class SecurityReport : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override {
    fs::remove_all(folder_);
    bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
  }
  /// Part of the report about `what`: mark and finding, and after "→" the meaning; empty: none.
  static std::string Of(const std::string& what, const std::string& report) {
    std::smatch found;
    const std::regex line("\n(\\S+ " + what + " [^\n]*\n +→ [^\n]+)");
    return std::regex_search(report, found, line) ? found[1].str() : std::string();
  }
  std::string Report(const std::vector<std::string>& more = {}, const std::string& shell = "") {
    std::string command = shell + FULCRUM_BIN_DIR "/fulcrum doctor --security --domain " + std::to_string(kDomain);
    for (const std::string& word : more) command += " " + word;
    Program doctor("/bin/sh", {"-c", command});
    const int code = doctor.End(0);
    const std::string said = "\n" + doctor.Said();
    EXPECT_EQ(code, said.find("\n! ") == std::string::npos ? 0 : 1) << said;
    return said;
  }

  const fs::path folder_ = fs::temp_directory_path() / ("fulcrum-security-report-" + std::to_string(::getpid()));
};

TEST_F(SecurityReport, SaysOfEachFindingWhatItMeans) {
  const std::string report = Report();
  std::istringstream lines(report);
  std::string line;
  std::getline(lines, line);
  int findings = 0;
  for (; std::getline(lines, line); ++findings) {
    EXPECT_TRUE(line.starts_with("✓ ") || line.starts_with("– ") || line.starts_with("! ")) << line;
    ASSERT_TRUE(std::getline(lines, line)) << report;
    EXPECT_NE(line.find("→ "), std::string::npos) << line;
  }
  EXPECT_GE(findings, 12) << report;
  EXPECT_TRUE(Of("core dumps", Report({}, "ulimit -c 0; ")).starts_with("✓")) << report;
  EXPECT_TRUE(Of("new files", Report({}, "umask 0; ")).starts_with("!")) << report;
  EXPECT_TRUE(Of("new files", Report({}, "umask 077; ")).starts_with("✓")) << report;
}

TEST_F(SecurityReport, KeysThatOthersCanReadAndLeftMemoryNeedALook) {
  const fs::path keys = folder_ / "keys", cart = folder_ / "cart.yaml";
  ASSERT_EQ(Program("fulcrum", {"keys", "init", keys}).End(0), 0);
  std::ofstream(cart) << "security: {keys: " << keys.string() << "}\n";
  EXPECT_TRUE(Of("keys of the cart", Report({"--cart", cart})).starts_with("✓"));
  ASSERT_EQ(Program("fulcrum", {"keys", "issue", "probe", "--read", "Health", "--keys", keys}).End(0), 0);
  ASSERT_EQ(Program("fulcrum", {"keys", "revoke", "probe", "--keys", keys}).End(0), 0);
  const std::string revoked = Of("keys of the cart", Report({"--cart", cart}));
  EXPECT_TRUE(revoked.starts_with("✓")) << revoked;
  EXPECT_NE(revoked.find("1 revoked"), std::string::npos) << revoked;
  fs::permissions(keys, fs::perms::all);
  const std::string open = Of("keys of the cart", Report({"--cart", cart}));
  EXPECT_TRUE(open.starts_with("!")) << open;
  bus::PrepareSharedMemory(bus::SharedMemoryDirectory(kDomain));
  const std::string left = Of("shared memory", Report());
  EXPECT_TRUE(left.starts_with("!")) << left;
  EXPECT_NE(left.find("left by a killed session"), std::string::npos) << left;
}

TEST_F(SecurityReport, NamesTheFiltersOfEachRunningNode) {
  testing::Cart cart("small", kDomain);
  ASSERT_TRUE(testing::WaitFor(30, [&] { return cart.PictureTime() > 0; })) << cart.Said();
  const std::string report = Report();
  for (const char* node : {"handle_bridge", "haptics_node", "physics_node", "thermal_node", "render_node"}) {
    const std::string said = Of(node, report);
    EXPECT_NE(said.find("system calls filtered, no new privileges"), std::string::npos) << node << report;
  }
  EXPECT_NE(Of("shared memory", report).find("mode 0700"), std::string::npos) << report;
  EXPECT_NE(Of("bus of the session", report), "") << report;
}

}  // namespace
}  // namespace fulcrum
