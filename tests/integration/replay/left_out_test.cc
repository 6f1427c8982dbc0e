// A scene without some of the nodes: the replayer makes only the nodes of the scene.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/integration/replay/short_session.h"
#include "tests/support/program.h"

namespace fulcrum::replay {
namespace {

constexpr std::uint32_t kThermalBit = 1u << static_cast<unsigned>(NodeId::kThermal);

struct Answer {
  int code;
  std::string said;
};

Answer ReplayInto(const testing::ShortSession& session, const std::vector<std::string>& nodes) {
  std::vector<std::string> words{session.recording(), "--into"};
  words.insert(words.end(), nodes.begin(), nodes.end());
  fulcrum::testing::Program program("replayer", words);
  const int code = program.End(0);
  return {code, program.Said()};
}

TEST(LeftOut, NodesThatTheSceneHasNotAreNamedAndNoFailure) {
  const testing::ShortSession session("left_out", {.seconds = 0.3},
                                      [](scene::SceneData* data) { data->fixed.node_mask &= ~kThermalBit; });
  const Answer both = ReplayInto(session, {"physics", "thermal"});
  EXPECT_EQ(both.code, 0) << both.said;
  EXPECT_NE(both.said.find("thermal_node: not in scene \"small\", left out"), std::string::npos) << both.said;
  EXPECT_NE(both.said.find("physics_node"), std::string::npos) << both.said;
  const Answer none = ReplayInto(session, {"thermal"});
  EXPECT_EQ(none.code, 2) << none.said;
  EXPECT_NE(none.said.find("has no thermal_node"), std::string::npos) << none.said;
}

}  // namespace
}  // namespace fulcrum::replay
