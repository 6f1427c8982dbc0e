// A wall that breathes down to the tissue and up again, in mode accurate.
#include "services/base/core/breathing.h"

#include <gtest/gtest.h>

#include <cstring>

#include "physics_node/node/physics_checkpoint.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"

namespace fulcrum::physics {
namespace {

constexpr float kAbove = 0.005f, kAmplitude = 0.008f, kPeriod = 4.0f;
constexpr int kPeriodSteps = 400;

/// The small scene and a flat wall 5 mm above the top of its membrane, facing down, which moves 8 mm down.
scene::SceneData UnderAWall(float amplitude_m = kAmplitude) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  float top = -1;
  for (const Vec3f& p : data.rest_position) {
    top = std::max(top, p.z());
  }
  StaticSurface wall{};
  std::strncpy(wall.name, "wall", sizeof(wall.name) - 1);
  wall.role = SurfaceRole::kAbdominalWall;
  wall.first_vertex = static_cast<Index>(data.static_vertices.size());
  wall.vertex_count = 4;
  wall.first_triangle = static_cast<Index>(data.static_triangles.size());
  wall.triangle_count = 2;
  wall.collides = 1;
  const Index a = wall.first_vertex;
  for (const auto& [x, y] : {std::pair{-0.1f, -0.1f}, {-0.1f, 0.1f}, {0.1f, 0.1f}, {0.1f, -0.1f}}) {
    data.static_vertices.emplace_back(x, y, top + kAbove);
  }
  data.static_triangles.push_back({a, a + 1, a + 2});
  data.static_triangles.push_back({a, a + 2, a + 3});
  data.static_surfaces = {wall};  // The only surface that breathes.
  data.fixed.breathing = {-Vec3f::UnitZ(), amplitude_m, kPeriod};
  return data;
}

TEST(Breathing, TheWallPushesTheTissueAndLetsItComeBackAndSleep) {
  const scene::SceneData data = UnderAWall();
  TissueSimulation simulation(data.View());
  float most = 0;
  int asleep = 0;
  for (int step = 1; step <= 2 * kPeriodSteps; ++step) {
    simulation.Step({});
    const float displacement = simulation.MaxDisplacement();
    const float lowest = kAmplitude - kAbove;  // Depth of the pushed membrane below its top at rest.
    ASSERT_LT(displacement, 2.0f * lowest) << step;
    most = std::max(most, displacement);
    asleep += simulation.asleep();
    if (step % kPeriodSteps == kPeriodSteps / 2) {
      EXPECT_GT(most, 0.8f * lowest) << "in this breath";
      EXPECT_FALSE(simulation.asleep());
      most = 0;
    }
    if (step % kPeriodSteps == kPeriodSteps * 19 / 20) {
      EXPECT_LT(displacement, 1e-4f);
      most = 0;
    }
  }
  EXPECT_GT(asleep, 50);  // While the wall is up.
  EXPECT_NEAR(simulation.simulated_time_s(), 2.0 * kPeriod, 1e-5);
}

TEST(Breathing, LongStepsKeepItsTime) {
  const scene::SceneData data = UnderAWall();
  TissueSimulation short_steps(data.View()), long_steps(data.View());
  for (int period = 0, turn = 0; period < kPeriodSteps / 2; ++turn) {
    const int periods = std::min(1 + turn % 3, kPeriodSteps / 2 - period);
    for (int i = 0; i < periods; ++i) {
      short_steps.Step({});
    }
    long_steps.Step({}, static_cast<std::uint64_t>(periods));
    period += periods;
    ASSERT_EQ(long_steps.simulated_time_s(), short_steps.simulated_time_s());
    ASSERT_NEAR(long_steps.MaxDisplacement(), short_steps.MaxDisplacement(), 4e-4f) << period;
  }
  EXPECT_GT(long_steps.MaxDisplacement(), 0.8f * (kAmplitude - kAbove));
}

TEST(Breathing, AWallOutOfReachWakesNobody) {
  const scene::SceneData data = UnderAWall(0.6f * kAbove);
  TissueSimulation simulation(data.View());
  for (int step = 1; step <= kPeriodSteps; ++step) {
    const StepReport report = simulation.Step({});
    ASSERT_TRUE(report.asleep || step < 100) << step;
  }
  EXPECT_LT(simulation.MaxDisplacement(), 1e-6f);
}

TEST(Breathing, GoesOnFromTheCheckpoint) {
  const scene::SceneData data = UnderAWall();
  TissueSimulation first(data.View()), second(data.View());
  for (int step = 0; step < kPeriodSteps / 4; ++step) {
    first.Step({});
  }
  std::vector<std::byte> slot(CheckpointCapacity(first.particles().particle_count()));
  const std::size_t size = WriteCheckpoint(first, {}, slot);
  ASSERT_TRUE(ReadCheckpoint(std::span<const std::byte>(slot).first(size), &second));
  EXPECT_EQ(second.simulated_time_s(), first.simulated_time_s());
  for (int step = 0; step < kPeriodSteps / 4; ++step) {
    first.Step({});
    second.Step({});
  }
  EXPECT_GT(second.MaxDisplacement(), 0.002f);
  EXPECT_NEAR(second.MaxDisplacement(), first.MaxDisplacement(), 2e-4f);
}

}  // namespace
}  // namespace fulcrum::physics
