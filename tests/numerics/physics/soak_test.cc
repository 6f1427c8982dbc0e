// A million substeps of the accurate mode on a scene so small that they take seconds: nothing drifts, nothing grows.
#include <gtest/gtest.h>

#include <cmath>

#include "services/scene/build.h"
#include "tests/numerics/physics/accurate_under_test.h"

namespace fulcrum::physics {
namespace {

scene::SceneData TinyScene() {
  scene::SceneSettings settings = scene::Small();
  settings.tube.rings = 5;
  settings.tube.segments = 6;
  settings.membrane.rows = 13;
  settings.membrane.cols = 9;
  settings.physics.preset = PhysicsPreset::kReference;
  settings.physics.damping_per_s = 20;
  settings.physics.membrane_Et_N_per_m = 300;
  settings.physics.membrane_prestrain = 0.04f;
  return scene::BuildProcedural(settings);
}

TEST(Soak, AMillionSubstepsLeaveTheTissueWhereItWas) {
  constexpr int kFrames = 1'000'000 / 8;  // The reference preset has eight substeps a frame.
  constexpr int kPullEvery = 5000, kPullFrames = 100, kQuiet = 300;
  const scene::SceneData data = TinyScene();
  const SceneView scene = data.View();
  AccurateUnderTest solver(scene);
  const Index particle = scene.membrane.first + 6 * scene.membrane.cols + 4;
  const std::size_t count = scene.rest_position.size();
  std::vector<float> xyz(3 * count);
  const auto largest = [&] {
    solver.ReadPositions(xyz);
    float most = 0;
    for (std::size_t p = 0; p < count; ++p) {
      const Vec3f x(xyz[3 * p], xyz[3 * p + 1], xyz[3 * p + 2]);
      if (!x.allFinite()) {
        return std::numeric_limits<float>::infinity();
      }
      most = std::max(most, (x - scene.rest_position[p]).norm());
    }
    return most;
  };
  // Now and then a pull of 5 mm, then rest.
  for (int frame = 0; frame < kFrames; ++frame) {
    const int phase = frame % kPullEvery;
    if (phase == 0) {
      solver.Hold({&particle, 1});
    }
    if (phase < kPullFrames) {
      const Vec3f place = scene.rest_position[particle] + Vec3f(0, 0, 0.005f * static_cast<float>(phase) / kPullFrames);
      solver.MoveHeld({&place, 1});
    } else if (phase == kPullFrames) {
      solver.Hold({});
      solver.MoveHeld({});
    }
    solver.Step();
    if (phase == kPullFrames / 2) {
      ASSERT_LT(largest(), 0.004f) << frame;
    } else if (phase == kPullFrames + kQuiet) {
      ASSERT_LT(largest(), 1e-4f) << frame;
    } else if (phase == kPullEvery - 1) {
      ASSERT_LT(largest(), 2e-5f) << frame;
    }
  }
}

}  // namespace
}  // namespace fulcrum::physics
