// Several solids of different stiffness that hang on each other: the real-time solver against Newton's method on the
// same energy.
#include <gtest/gtest.h>

#include "tests/numerics/physics/accurate_under_test.h"
#include "tests/numerics/physics/reference/static_solver.h"
#include "tests/support/several_solids.h"

namespace fulcrum::physics {
namespace {

class SeveralSolidsUnderGravity : public testing::TestWithParam<PhysicsPreset> {};

TEST_P(SeveralSolidsUnderGravity, SagAsTheReferenceAndSleep) {
  scene::SceneData data = SeveralSolids(Vec3f(0, 0, -9.81f));
  data.fixed.physics.preset = GetParam();
  // Nothing holds the lump but contact, which is not part of the energy.
  const Solid lump = data.solids[2];
  std::fill_n(data.inverse_mass.begin() + lump.first_vertex, lump.vertex_count, 0.0f);
  const SceneView scene = data.View();
  const reference::ElasticEnergy energy(BuildElasticModel(scene));
  const reference::Points rest = reference::RestPoints(energy.model());
  const reference::StaticResult truth = reference::SolveStatic(energy, rest, {}, {});
  AccurateUnderTest solver(scene);
  for (int i = 0; i < 250; ++i) solver.Step();
  EXPECT_EQ(solver.awake_part(), 0);
  Eigen::Matrix3Xf xyz(3, rest.cols());
  solver.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
  const reference::Points x = xyz.cast<double>();
  for (const Solid& solid : data.solids) {
    const auto of = [&](const reference::Points& p) { return p.middleCols(solid.first_vertex, solid.vertex_count); };
    const double sag = (of(truth.x) - of(rest)).norm(), off = (of(x) - of(truth.x)).norm();
    EXPECT_LE(off, 0.006 * sag + 1e-9) << solid.name << ": " << 100 * off / std::max(sag, 1e-12) << " % off";
  }
}

INSTANTIATE_TEST_SUITE_P(Presets, SeveralSolidsUnderGravity,
                         testing::Values(PhysicsPreset::kFast, PhysicsPreset::kDefault, PhysicsPreset::kAccurate));

}  // namespace
}  // namespace fulcrum::physics
