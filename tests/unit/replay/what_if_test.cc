#include "services/apps/replayer/what_if.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "services/apps/replayer/changed_scene.h"
#include "services/apps/replayer/coupled_nodes.h"
#include "services/apps/replayer/session_facts.h"
#include "services/apps/replayer/tick_source.h"
#include "services/apps/replayer/what_if_report.h"
#include "services/base/core/error.h"
#include "services/base/core/solids.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/scene/format/scene_file.h"
#include "tests/unit/replay/recorded_cart.h"

namespace fulcrum::replay {
namespace {

class WhatIfTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::filesystem::temp_directory_path() / ("fulcrum_what_if_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    const std::filesystem::path yaml = std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes/small.yaml";
    const auto description = scene::ReadSceneYaml(yaml, {});
    const scene::SceneData data = scene::BuildScene(description.settings, {});
    scene::WriteSceneFile(data, description.effective_yaml, folder_ / "scene");
    scene_ = std::make_unique<scene::SceneFile>(folder_ / "scene");
    cut_m_ = testing::RecordCart(scene_->view(), folder_, {.seconds = 3.2});
  }
  static void TearDownTestSuite() {
    scene_.reset();
    std::filesystem::remove_all(folder_);
  }

  static WhatIfResult WhatIf(const std::vector<std::string>& changes, const std::vector<NodeId>& nodes) {
    const LockStepSettings settings{folder_ / "recording.mcap", nodes, folder_ / "again", 0, 1, -1};
    std::filesystem::remove_all(settings.folder);
    std::vector<Solid> solids;
    return ReplayWhatIf(settings, scene_->view(), WithChanges(*scene_, changes, &solids), {}, {});
  }

  static std::filesystem::path folder_;
  static std::unique_ptr<scene::SceneFile> scene_;
  static float cut_m_;  ///< As recorded.
};
std::filesystem::path WhatIfTest::folder_;
float WhatIfTest::cut_m_ = 0;
std::unique_ptr<scene::SceneFile> WhatIfTest::scene_;

TEST_F(WhatIfTest, NothingChangedIsNoDifference) {
  const WhatIfResult result = WhatIf({}, {NodeId::kPhysics, NodeId::kThermal, NodeId::kHaptics});
  EXPECT_LT(result.first_difference_s, 0);
  EXPECT_EQ(result.missing, "");
  EXPECT_GT(result.frames, 200u);
  EXPECT_EQ(result.max_position_mm, 0);
  EXPECT_GT(result.cut_length_mm.before, 1);
  EXPECT_EQ(result.cut_length_mm.before, result.cut_length_mm.after);
}

// Thermal publishes in milliseconds 3 of ten and physics reads in 0, in the recording as in a coupled replay, so the
// states are the recorded ones.
TEST_F(WhatIfTest, AProcessOfPhysicsThatStartsAfterTheCutHasTheCut) {
  const std::filesystem::path folder = folder_ / "killed";
  std::filesystem::create_directories(folder);
  EXPECT_GT(testing::RecordCart(scene_->view(), folder, {.seconds = 3.2, .kill_physics_s = 2.9}), 1e-3f);
  const std::vector<NodeId> both{NodeId::kPhysics, NodeId::kThermal};
  TickSource source(folder / "recording.mcap", both, NodePeriods({}));
  const config::CartConfig cart;
  CoupledNodes nodes(both, {scene_->view(), cart, folder / "again", 1});
  RecordedTick tick;
  std::map<std::uint64_t, int> different;  // By the epoch of physics.
  while (source.Next(&tick)) {
    ASSERT_EQ(tick.missing, "");
    const Outcome outcome = nodes.Step(tick);
    if (tick.node == NodeId::kPhysics) different[tick.epoch] += outcome.state_hash == tick.state_hash ? 0 : 1;
  }
  ASSERT_EQ(different.size(), 2u);
  EXPECT_EQ(different.begin()->second, 0);
  EXPECT_EQ(different.rbegin()->second, 0) << "the sheet of the new process is whole";
}

TEST_F(WhatIfTest, EachNodeWithARateHasAPeriod) {
  const config::CartConfig cart;
  const auto period_s = NodePeriods(cart);
  for (std::size_t node = 0; node < period_s.size(); ++node) {
    EXPECT_EQ(period_s[node] > 0, cart.timing(static_cast<NodeId>(node)).rate_Hz > 0) << node;
  }
  EXPECT_DOUBLE_EQ(period_s[static_cast<std::size_t>(NodeId::kRender)], 0.033333333);
}

TEST_F(WhatIfTest, AWeakGripLetsGo) {
  const WhatIfResult result = WhatIf({"physics.grip_force_N=0.2"}, {NodeId::kPhysics});
  EXPECT_GT(result.first_difference_s, 1.0) << "the tissue is not pulled before";
  EXPECT_GT(result.max_position_mm, 2);
  EXPECT_LT(result.peak_tissue_force_N.after, result.peak_tissue_force_N.before);
}

TEST_F(WhatIfTest, AWeakGeneratorCutsLess) {
  const WhatIfResult result = WhatIf({"thermal.v_max_V=100"}, {NodeId::kPhysics, NodeId::kThermal});
  EXPECT_EQ(result.first_node, NodeId::kThermal);
  EXPECT_LT(result.cut_length_mm.after, result.cut_length_mm.before);
  EXPECT_GT(result.max_position_mm, 0) << "uncut tissue moves differently: physics uses the output of thermal";
  EXPECT_NE(ReportText(result, {NodeId::kPhysics, NodeId::kThermal}).find("cut length"), std::string::npos);
}

// Open loop: the hook keeps its recorded path, and no discharge burns across the steam beneath it. (Immediate boiling
// would not be such a change: it widens the hole, and the centre line of a wide hole is not longer.)
TEST_F(WhatIfTest, BelowTheVoltageOfDischargesHardlyAnythingIsCut) {
  const WhatIfResult result = WhatIf({"thermal.v_max_V=60"}, {NodeId::kThermal});
  EXPECT_EQ(result.missing, "");
  EXPECT_EQ(result.first_node, NodeId::kThermal);
  EXPECT_GT(result.first_difference_s, 2.0) << "the pedal is up before";
  EXPECT_FLOAT_EQ(static_cast<float>(result.cut_length_mm.before), 1e3f * cut_m_) << "as it was recorded";
  EXPECT_GT(result.cut_length_mm.before, 1);
  EXPECT_LT(result.cut_length_mm.after, 0.5 * result.cut_length_mm.before);
  EXPECT_EQ(result.frames, 0u) << "nothing but thermal was replayed";
}

TEST_F(WhatIfTest, TheOrgansModulusIsChangedAlsoBesideOtherBodies) {
  const auto description = scene::ParseSceneYaml(
      "name: two\nphysics: {mode: accurate}\norgan: {procedural: {rings: 22, segments: 10, length_mm: 100}}\n"
      "membrane: {rows: 41, cols: 22}\nbodies: [{name: lobe, material: liver, shape: {ellipsoid_mm: [15, 20, 10], "
      "at_mm: [0, 0, 60]}, tet_edge_mm: 8}]\n",
      "two.yaml", {});
  scene::WriteSceneFile(scene::BuildScene(description.settings, {}), description.effective_yaml, folder_ / "two");
  const scene::SceneFile two(folder_ / "two");
  std::vector<Solid> solids;
  const SceneView same = WithChanges(two, {}, &solids);
  EXPECT_EQ(YoungsModulusOf(same, 0), YoungsModulusOf(two.view(), 0));
  const SceneView changed = WithChanges(two, {"physics.tube_youngs_modulus_kPa=2"}, &solids);
  EXPECT_EQ(YoungsModulusOf(changed, 0), 2000.0f);
  EXPECT_EQ(YoungsModulusOf(changed, 1), YoungsModulusOf(two.view(), 1));
  EXPECT_EQ(changed.hash, two.view().hash);
}

TEST_F(WhatIfTest, BadChangesAreNamed) {
  const auto refusal = [](const std::string& change) {
    try {
      std::vector<Solid> solids;
      (void)WithChanges(*scene_, {change}, &solids);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal("membrane.rows=7").find("section of physics"), std::string::npos);
  EXPECT_NE(refusal("physics").find("section.key=value"), std::string::npos);
  EXPECT_NE(refusal("physics.tube_poisson=0.7").find("0.495"), std::string::npos);
  EXPECT_NE(refusal("physics.grip=7").find("grip"), std::string::npos);
}

}  // namespace
}  // namespace fulcrum::replay
