// Solids that slide on each other in the whole simulation: contact, sleep, threads, restart.
#include <gtest/gtest.h>

#include <vector>

#include "physics_node/simulation/tissue_simulation.h"
#include "tests/support/sliding_blocks.h"

namespace fulcrum::physics {
namespace {

using scene::AttachKind;

/// Thirty degrees.
const Vec3f kIncline(4.9f, 0, -8.5f);

class SlidingSolids : public testing::Test {
 protected:
  explicit SlidingSolids(const Vec3f& gravity = kIncline) : data_(TwoBlocks(AttachKind::kSliding, gravity)) {}

  [[nodiscard]] Vec3f MeanOf(const TissueSimulation& simulation, Index solid) const {
    const Solid& s = scene_.solids[solid];
    Vec3f sum = Vec3f::Zero();
    for (Index v = s.first_vertex; v < s.first_vertex + s.vertex_count; ++v) {
      sum += simulation.particles().At(simulation.particles().Ref(v));
    }
    return sum / static_cast<float>(s.vertex_count);
  }

  scene::SceneData data_;
  SceneView scene_ = data_.View();
};

class SlidingSolidsWithoutGravity : public SlidingSolids {
 protected:
  SlidingSolidsWithoutGravity() : SlidingSolids(Vec3f::Zero()) {}
};

TEST_F(SlidingSolids, SlideDownAnInclineAndGluedOnesDoNot) {
  const scene::SceneData glued_data = TwoBlocks(AttachKind::kGlued, kIncline);
  const SceneView glued_scene = glued_data.View();
  TissueSimulation sliding(scene_), glued(glued_scene);
  const Vec3f before = MeanOf(sliding, kUpperBlock);
  for (int i = 0; i < 12; ++i) {
    sliding.Step({});
    glued.Step({});
  }
  EXPECT_GT(MeanOf(sliding, kUpperBlock).x() - before.x(), 0.008f);
  EXPECT_NEAR(MeanOf(sliding, kUpperBlock).z(), before.z(), 5e-4f);
  EXPECT_LT(MeanOf(glued, kUpperBlock).x() - before.x(), 0.001f);
  EXPECT_EQ(sliding.quarantined(), 0u);
}

TEST_F(SlidingSolids, AreTheSameOnAnyNumberOfThreads) {
  TissueSimulation one(scene_, 1), two(scene_, 2), three(scene_, 3);
  two.LetThreadsHelp(true);
  three.LetThreadsHelp(true);
  for (int i = 0; i < 60; ++i) {
    one.Step({});
    two.Step({});
    three.Step({});
    ASSERT_EQ(one.StateHash(), two.StateHash()) << "step " << i;
    ASSERT_EQ(one.StateHash(), three.StateHash()) << "step " << i;
  }
}

/// Where a vertex is over the other solid is found again from the positions.
TEST_F(SlidingSolids, GoOnAfterARestart) {
  TissueSimulation simulation(scene_), restarted(scene_), again(scene_);
  for (int i = 0; i < 8; ++i) simulation.Step({});
  std::vector<float> xyz(3 * scene_.rest_position.size()), previous(xyz.size());
  simulation.particles().CopyPositions(xyz);
  simulation.particles().CopyPrevious(previous);
  const SimulationMemory memory = simulation.Save();
  ASSERT_TRUE(restarted.Restore(xyz, previous, memory));
  ASSERT_TRUE(again.Restore(xyz, previous, memory));
  for (int i = 0; i < 6; ++i) {
    simulation.Step({});
    restarted.Step({});
    again.Step({});
    EXPECT_LT((MeanOf(restarted, kUpperBlock) - MeanOf(simulation, kUpperBlock)).norm(), 1e-3f) << i;
    EXPECT_EQ(restarted.StateHash(), again.StateHash()) << i;
  }
}

TEST_F(SlidingSolidsWithoutGravity, RestAndSleep) {
  TissueSimulation simulation(scene_);
  int steps = 0;
  while (!simulation.Step({}).asleep && steps < 200) ++steps;
  EXPECT_LT(steps, 100);
  EXPECT_LT(simulation.MaxDisplacement(), 1e-5f);
}

/// A grasper presses the upper block: the lower one, which slept, yields.
TEST_F(SlidingSolidsWithoutGravity, WakeWhatTheyLieOn) {
  TissueSimulation simulation(scene_);
  while (!simulation.Step({}).asleep) {
  }
  std::array<ToolInput, kMaxTools> tools{};
  tools[0].present = true;
  tools[0].pose.q_WT = Quatf(0, 1, 0, 0);  // Its tip points down.
  tools[0].pose.jaw_rad = 0;
  const Vec3f before = MeanOf(simulation, kLowerBlock);
  for (int i = 0; i < 120; ++i) {
    tools[0].pose.p_WT = Vec3f(0, 0, 0.020f - 0.0001f * static_cast<float>(std::min(i, 100)));
    simulation.Step(tools);
  }
  EXPECT_LT(MeanOf(simulation, kLowerBlock).z(), before.z() - 1e-5f);
  EXPECT_EQ(simulation.quarantined(), 0u);
}

}  // namespace
}  // namespace fulcrum::physics
