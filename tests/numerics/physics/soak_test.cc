// A million computed substeps of the accurate mode on a scene so small that they take a minute: no drift and no growth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "services/scene/builder/build.h"
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
  // The reference preset has eight substeps a frame. Only frames in which tissue was awake count.
  constexpr int kFrames = 1'000'000 / 8;
  constexpr int kRound = 1000, kRise = 100, kSwing = 700, kQuiet = 200;
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
  // Lift by 5 mm, move around a circle of 1.5 mm radius for 6 s, then release.
  int computed = 0;
  for (int frame = 0; computed < kFrames; ++frame) {
    const int phase = frame % kRound;
    if (phase == 0) {
      solver.Hold({&particle, 1});
    }
    if (phase < kSwing) {
      const float height = 0.005f * std::min(1.0f, static_cast<float>(phase) / kRise);
      const float turn = 0.05f * static_cast<float>(std::max(0, phase - kRise));
      const Vec3f place =
          scene.rest_position[particle] + Vec3f(0.0015f * std::sin(turn), 0.0015f * (std::cos(turn) - 1), height);
      solver.MoveHeld({&place, 1});
    } else if (phase == kSwing) {
      solver.Hold({});
      solver.MoveHeld({});
    }
    solver.Step();
    computed += solver.awake_part() > 0;
    if (phase == kSwing / 2) {
      ASSERT_LT(largest(), 0.008f) << frame;
    } else if (phase == kSwing + kQuiet) {
      ASSERT_LT(largest(), 1e-4f) << frame;
    } else if (phase == kRound - 1) {
      ASSERT_LT(largest(), 2e-5f) << frame;
    }
    ASSERT_LT(frame, 2 * kFrames) << "the tissue sleeps while it is pulled";
  }
}

}  // namespace
}  // namespace fulcrum::physics
