// Options and output of the command `fulcrum` where no session runs.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

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

TEST_F(CommandsTest, TheDoctorReadsTheCartFileThatIsGiven) {
  (void)Run({"doctor", "--out", folder_.string(), "--cart", cart_.string()});
  EXPECT_TRUE(Said("✓ cart                " + cart_.string() + ", \"bench\"")) << said_;
  WriteFile(cart_, "domain: 500\n");
  EXPECT_EQ(Run({"doctor", "--out", folder_.string(), "--cart", cart_.string()}), 1);
  EXPECT_TRUE(Said("✗ cart")) << said_;
  fs::remove(cart_);
  EXPECT_EQ(Run({"doctor", "--out", folder_.string(), "--cart", cart_.string()}), 1);
  EXPECT_TRUE(Said("✗ cart")) << said_;
}

}  // namespace
}  // namespace fulcrum::supervisor
