// The sessions with a known verdict that need no whole cart; deploy/bench guard. runs the others, too.
#include "tests/support/verdict_scenarios.h"

#include <gtest/gtest.h>

namespace fulcrum {
namespace {

constexpr int kDomain = 94;

TEST(VerdictScenarios, FakeNodesGetTheKnownVerdict) {
  for (const testing::Scenario& scenario : testing::VerdictScenarios()) {
    if (scenario.is_real) continue;
    const testing::ScenarioResult result = testing::RunScenario(scenario, kDomain);
    EXPECT_EQ(result.wrong, "") << scenario.name << "\n" << result.said;
  }
}

}  // namespace
}  // namespace fulcrum
