// A short soak with all parts of a long one.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/support/cart.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

fs::path Out() { return fs::path(::testing::TempDir()) / "soak_test"; }

TEST(Soak, BlowsAreSurvivedAndTold) {
  fs::remove_all(Out());
  fulcrum::testing::Program soak(
      "fulcrum", {"soak", "small", "--minutes", "0.6", "--chaos", "--seed", "2", "--domain", "59", "--out", Out()});
  std::optional<int> code;
  ASSERT_TRUE(fulcrum::testing::WaitFor(150, [&] { return (code = soak.Poll()).has_value(); })) << soak.Said();
  const std::string said = soak.Said();
  EXPECT_EQ(*code, 0) << said;
  for (const char* figure : {"soak.minutes 0.", "soak.rss_growth_MB", "soak.nan 0", "soak.crashes 0"}) {
    EXPECT_NE(said.find(figure), std::string::npos) << figure << "\n" << said;
  }
  const std::string page = fulcrum::testing::ReadFile(Out() / "soak" / "soak.html");
  EXPECT_NE(page.find("killed on purpose"), std::string::npos) << said;
  EXPECT_TRUE(fs::exists(Out() / "soak" / "latest" / "report.html"));
  fs::remove_all(Out());
}

TEST(Soak, ALengthBeyondThatOfAScriptIsRefusedByItsName) {
  fulcrum::testing::Program soak("fulcrum", {"soak", "small", "--minutes", "1441", "--domain", "59", "--out", Out()});
  std::optional<int> code;
  ASSERT_TRUE(fulcrum::testing::WaitFor(20, [&] { return (code = soak.Poll()).has_value(); })) << soak.Said();
  EXPECT_EQ(*code, 2);
  EXPECT_NE(soak.Said().find("--minutes 1441.00: must be 0.2 to 1440"), std::string::npos) << soak.Said();
}

TEST(Soak, ANodeThatEndsByItselfIsACrash) {
  fs::remove_all(Out());
  fulcrum::testing::Program soak("fulcrum", {"soak", "small", "--minutes", "0.2", "--domain", "59", "--out", Out()});
  pid_t thermal = 0;
  // thermal_node of the session that the soak has started.
  ASSERT_TRUE(fulcrum::testing::WaitFor(90, [&] {
    const auto up = fulcrum::testing::ChildrenOf(soak.pid());
    if (!up.contains("fulcrum") || soak.Said().find("nodes run") == std::string::npos) return false;
    const auto nodes = fulcrum::testing::ChildrenOf(up.at("fulcrum"));
    if (!nodes.contains("thermal_node")) return false;
    thermal = nodes.at("thermal_node");
    return true;
  })) << soak.Said();
  // Time for the soak to register the process.
  (void)fulcrum::testing::WaitFor(1.5, [] { return false; });
  ::kill(thermal, SIGKILL);
  std::optional<int> code;
  ASSERT_TRUE(fulcrum::testing::WaitFor(60, [&] { return (code = soak.Poll()).has_value(); })) << soak.Said();
  EXPECT_EQ(*code, 1) << soak.Said();
  EXPECT_NE(soak.Said().find("soak.crashes 1"), std::string::npos) << soak.Said();
  EXPECT_NE(fulcrum::testing::ReadFile(Out() / "soak" / "soak.html").find("BY ITSELF"), std::string::npos);
  fs::remove_all(Out());
}

}  // namespace
}  // namespace fulcrum
