// A session whose hook burns a liver without any sheet: what reaches the report, the pictures and the recording, also
// when thermal_node is killed in the middle of the stroke.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "services/records/log_tools/recording.h"
#include "tests/support/cart.h"
#include "tests/support/replay_run.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

constexpr int kDomain = 92;
constexpr const char* kScene = R"(name: burn
bodies:
  - {name: liver, material: liver, shape: {ellipsoid_mm: [60, 40, 25], at_mm: [0, 0, -30]}, tet_edge_mm: 9,
     held_side: [0, 0, -1], held_share: 0.4}
tools:
  tool1: {kind: hook, trocar_mm: [90, -30, 60]}
physics: {mode: accurate, dt_ms: 10, gravity_m_s2: [0, 0, 0]}
render: {scope_tip_mm: [4, -74, 62], scope_target_mm: [0, 0, -2], width: 640, height: 360}
script:
  duration_s: 10
  tool1:
    - {time_s: 0, world_mm: [30, -10, 20]}
    - {time_s: 2, world_mm: [20, -10, 0], pedal: coag, power_W: 30}
    - {time_s: 3.5, world_mm: [20, -10, -9], pedal: coag, power_W: 30}
    - {time_s: 8, world_mm: [4, -10, -9], pedal: coag, power_W: 30}
    - {time_s: 10, world_mm: [10, -10, 20]}
)";

/// Dead area in the burns of a recording, in their order [m^2]; and how many patches of solids there are.
struct RecordedBurns {
  std::vector<float> dead_m2;
  int patches = 0;
};
RecordedBurns BurnsIn(const fs::path& recording) {
  RecordedBurns burns;
  log_tools::Recording file(recording, {.topics = {"ThermalEvent", "TemperaturePatch"}});
  log_tools::Entry entry;
  while (file.Next(&entry)) {
    (void)log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (std::is_same_v<T, ThermalEvent>) {
        if (message.kind == ThermalEventKind::kSolidBurn) burns.dead_m2.push_back(message.value);
      } else if constexpr (std::is_same_v<T, TemperaturePatch>) {
        burns.patches += message.header.surface == BurntSurface::kSolids ? 1 : 0;
      }
    });
  }
  return burns;
}

TEST(Burn, ReachesReportAndRecordingAndOutlivesAKill) {
  const fs::path folder = fs::temp_directory_path() / ("burn_test." + std::to_string(::getpid()));
  fs::create_directories(folder);
  const fs::path scene = folder / "burn.yaml";
  std::ofstream(scene) << kScene;
  testing::Cart cart(scene.string(), kDomain, {"--record"});
  ASSERT_TRUE(testing::WaitFor(60, [&] { return cart.PictureTime() > 5; })) << cart.Said();
  const std::map<std::string, pid_t> nodes = cart.nodes();
  ASSERT_TRUE(nodes.contains("thermal_node")) << cart.Said();
  ASSERT_EQ(::kill(nodes.at("thermal_node"), SIGKILL), 0);
  ASSERT_EQ(cart.FaultAtEnd(60), "");
  const std::string summary = testing::ReadFile(cart.session() / "summary.json");
  EXPECT_GT(testing::FigureOf(summary, "burnt.liver_mm2"), 5) << summary;
  EXPECT_EQ(testing::FigureOf(summary, "restarts"), 1);
  EXPECT_NE(testing::ReadFile(cart.session() / "report.html").find("burnt surface of liver"), std::string::npos);

  const RecordedBurns burns = BurnsIn(cart.session() / "recording.mcap");
  ASSERT_GT(burns.dead_m2.size(), 4u);
  EXPECT_TRUE(std::is_sorted(burns.dead_m2.begin(), burns.dead_m2.end())) << "dead tissue came to life at the restart";
  EXPECT_GT(burns.patches, 20);
  const testing::ReplayRun replay =
      testing::Replay(cart.session() / "recording.mcap", {"--into", "physics", "thermal"}, 60);
  EXPECT_EQ(replay.exit_code, 0) << replay.said;
  fs::remove_all(folder);
}

}  // namespace
}  // namespace fulcrum
