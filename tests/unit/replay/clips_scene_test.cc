// The shipped scene `clips` in lock step, on any machine the same: what its script clips and cuts, and whether the
// vessel bleeds.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/scene_yaml.h"
#include "tests/support/recorded_clips.h"
#include "tests/unit/replay/recorded_cart.h"

namespace fulcrum::replay {
namespace {

namespace fs = std::filesystem;

constexpr int kApplier = 2;
constexpr double kAside_s = 3.7;  // The applier is still aside.
constexpr double kCutEnds_s = 14.2;

class ClipsScene : public ::testing::Test {
 protected:
  ClipsScene()
      : folder_(fs::temp_directory_path() / ("clips_scene." + std::to_string(::getpid()))),
        settings_(scene::ReadSceneYaml(fs::path(FULCRUM_SOURCE_DIR) / "deploy/scenes/clips.yaml", {}).settings) {
    fs::create_directories(folder_);
  }
  ~ClipsScene() override { fs::remove_all(folder_); }
  fulcrum::testing::ClipOutcome Run() {
    const scene::SceneData data = scene::BuildScene(settings_, {});
    const SceneView view = data.View();
    const float cut_m = testing::RecordCart(view, folder_, {.seconds = kCutEnds_s, .record_frames = false});
    EXPECT_GT(cut_m, 0.001f);
    return fulcrum::testing::FollowClips(view, folder_ / "recording.mcap");
  }

  const fs::path folder_;
  scene::SceneSettings settings_;
};

TEST_F(ClipsScene, CutsAVesselBetweenTwoClipsWithoutBlood) {
  const auto outcome = Run();
  EXPECT_EQ(outcome.clips, 2u);
  EXPECT_GT(outcome.cuts, 0u);
  EXPECT_EQ(outcome.shed_m3, 0);
}

TEST_F(ClipsScene, BleedsWithoutClips) {
  std::erase_if(settings_.script, [](const auto& key) { return key.tool == kApplier && key.time_s > kAside_s; });
  const auto outcome = Run();
  EXPECT_EQ(outcome.clips, 0u);
  EXPECT_GT(outcome.cuts, 0u);
  EXPECT_GT(outcome.shed_m3, 1e-9);
}

// The vessel comes from the left and ends 3.5 mm to the right of the cut: the first clip closes its supply.
TEST_F(ClipsScene, BleedsWithTheFirstClipMissing) {
  std::erase_if(settings_.script,
                [](const auto& key) { return key.tool == kApplier && key.time_s > kAside_s && key.time_s < 6.9; });
  const auto outcome = Run();
  EXPECT_EQ(outcome.clips, 1u);
  EXPECT_GT(outcome.cuts, 0u);
  EXPECT_GT(outcome.shed_m3, 1e-9);
}

}  // namespace
}  // namespace fulcrum::replay
