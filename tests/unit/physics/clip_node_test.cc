// A physics node with a clip applier: what it publishes, counts, and keeps over a restart.
#include <unistd.h>

#include <filesystem>

#include "physics_node/node/physics_checkpoint.h"
#include "services/base/core/clips.h"
#include "tests/support/clipped_strips.h"
#include "tests/support/whole_topology.h"
#include "tests/unit/physics/node_bench.h"

namespace fulcrum::physics {
namespace {

class ClipNode : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(file_); }
  [[nodiscard]] std::unique_ptr<runtime::CheckpointFile> Open() const {
    return std::make_unique<runtime::CheckpointFile>(
        file_, scene_.hash, kCheckpointLayout, CheckpointCapacity(static_cast<Index>(scene_.rest_position.size())));
  }

  scene::SceneData data_ = ClippedStrips(PhysicsMode::kAccurate, Vec3f(0.004f, 0, 0));
  SceneView scene_ = data_.View();
  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("clip_node_" + std::to_string(getpid()) + ".checkpoint");
};

TEST_F(ClipNode, PublishesItsClipsOnChange) {
  Bench bench(scene_, nullptr);
  auto clips = bench.bus_.clips.MakeInput();
  ClipState state;
  bench.Play(0, 0.2);
  ASSERT_TRUE(clips->TakeNext(&state)) << "the first says what is there";
  EXPECT_EQ(state.count, 0u);
  EXPECT_EQ(state.scene_hash, scene_.hash);
  EXPECT_FALSE(clips->TakeNext(&state));
  bench.Play(0.2, kClipped_s);
  ASSERT_TRUE(clips->TakeNext(&state));
  ASSERT_EQ(state.count, 1u);
  EXPECT_EQ(state.clips[0].tool, 0);
  EXPECT_EQ(bench.Figure("clips"), 1);
  EXPECT_EQ(bench.Figure("clips_lost"), 0);
  EXPECT_EQ(bench.Figure("clips_refused"), 0);
  // Where the jaws are, on the tissue of the frame.
  const auto frame_place = [&](std::uint32_t vertex) {
    const ParticleStore& particles = bench.node_.simulation().particles();
    return particles.At(particles.Ref(vertex));
  };
  const auto& anchors = state.clips[0].anchors;
  const auto pose = PoseOf(state.clips[0], frame_place(anchors[0]), frame_place(anchors[1]), frame_place(anchors[2]));
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->p_WC - (bench.ToolPlace(0) + Vec3f(0, 0, 0.004f))).norm(), 3e-4f);
  EXPECT_GT((pose->q_WC * Vec3f::UnitZ()).dot(-Vec3f::UnitZ()), 0.99f) << "open towards the tip";
  bench.Play(kClipped_s, kClipFree_s);
  EXPECT_FALSE(clips->TakeNext(&state)) << "on change only";
  TopologyState cut = WholeTopology(scene_);
  cut.stamp = {1, 1, 1};
  cut.revision = 1;
  for (Index node = 0; node < scene_.membrane.node_count(); ++node) SetBit(cut.dead_nodes, node);
  bench.topology_out_->Write(cut);
  bench.Play(kClipFree_s, kClipFree_s + 0.05);
  ASSERT_TRUE(clips->TakeNext(&state));
  EXPECT_EQ(state.count, 0u);
  EXPECT_EQ(bench.Figure("clips_lost"), 1);
}

TEST_F(ClipNode, KeepsItsClipsOverAKill) {
  auto kept_until = [&](double time_s) {
    auto checkpoint = Open();
    Bench bench(scene_, checkpoint.get());
    bench.Play(0, time_s);
    ClipState state;
    auto clips = bench.bus_.clips.MakeInput();
    EXPECT_TRUE(clips->TakeLatest(&state)) << "a late reader";
    EXPECT_EQ(state.count, 1u);
    return state;
  };
  // Killed in the tick of the clip, which has been published: no checkpoint was due by the clock.
  double applied_s = 0.2;
  {
    Bench bench(scene_, nullptr);
    while (bench.node_.simulation().clips().empty() && applied_s < kClipped_s) {
      bench.Play(applied_s, applied_s + 0.01);
      applied_s += 0.01;
    }
  }
  for (const double killed_s : {applied_s, 2.0}) {
    std::filesystem::remove(file_);
    const ClipState before = kept_until(killed_s);
    auto checkpoint = Open();
    Bench bench(scene_, checkpoint.get(), 2);
    ASSERT_TRUE(bench.node_.restored()) << killed_s;
    auto clips = bench.bus_.clips.MakeInput();
    ClipState after;
    bench.Step();
    ASSERT_TRUE(clips->TakeNext(&after)) << killed_s;
    EXPECT_EQ(after.stamp.epoch, 2u);
    ASSERT_EQ(after.count, 1u);
    EXPECT_EQ(after.clips[0].anchors, before.clips[0].anchors);
    EXPECT_EQ(after.clips[0].p_AC, before.clips[0].p_AC);
    EXPECT_EQ(after.clips[0].q_AC.coeffs(), before.clips[0].q_AC.coeffs());
    EXPECT_EQ(bench.Figure("clips"), 1);
  }
}

TEST_F(ClipNode, ScenesWithoutAnApplierPublishNone) {
  data_ = ClippedStrips(PhysicsMode::kAccurate, Vec3f(0.004f, 0, 0), ToolKind::kGrasper);
  scene_ = data_.View();
  Bench bench(scene_, nullptr);
  auto clips = bench.bus_.clips.MakeInput();
  ClipState state;
  bench.Play(0, kClipped_s);
  EXPECT_FALSE(clips->TakeNext(&state));
  EXPECT_EQ(bench.Figure("clips"), -1);
}

}  // namespace
}  // namespace fulcrum::physics
