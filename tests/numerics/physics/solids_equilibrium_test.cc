// Several solids of different stiffness that hang on each other: the real-time solver against Newton's method on the
// same energy.
#include <gtest/gtest.h>

#include "tests/numerics/physics/accurate_under_test.h"
#include "tests/numerics/physics/reference/static_solver.h"
#include "tests/support/several_solids.h"

namespace fulcrum::physics {
namespace {

class SeveralSolidsUnderGravity : public testing::TestWithParam<PhysicsPreset> {
 protected:
  SeveralSolidsUnderGravity() {
    data_.fixed.physics.preset = GetParam();
    // Nothing holds the lump but contact, which is not part of the energy.
    const Solid lump = data_.solids[kLump];
    std::fill_n(data_.inverse_mass.begin() + lump.first_vertex, lump.vertex_count, 0.0f);
  }
  static constexpr std::size_t kLump = 2;

  /// Every solid but the lump is where Newton's method finds it.
  void ExpectEquilibrium(const AccurateUnderTest& solver) const {
    const reference::ElasticEnergy energy(BuildElasticModel(data_.View()));
    const reference::Points rest = reference::RestPoints(energy.model());
    const reference::StaticResult truth = reference::SolveStatic(energy, rest, {}, {});
    Eigen::Matrix3Xf xyz(3, rest.cols());
    solver.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
    const reference::Points x = xyz.cast<double>();
    for (const Solid& solid : data_.solids) {
      if (&solid == &data_.solids[kLump]) continue;
      const auto of = [&](const reference::Points& p) { return p.middleCols(solid.first_vertex, solid.vertex_count); };
      const double sag = (of(truth.x) - of(rest)).norm(), off = (of(x) - of(truth.x)).norm();
      EXPECT_LE(off, 0.006 * sag + 1e-9) << solid.name << ": " << 100 * off / std::max(sag, 1e-12) << " % off";
    }
  }

  scene::SceneData data_ = SeveralSolids(Vec3f(0, 0, -9.81f));
};

TEST_P(SeveralSolidsUnderGravity, SagAsTheReferenceAndSleep) {
  const SceneView scene = data_.View();
  AccurateUnderTest solver(scene);
  for (int i = 0; i < 250; ++i) solver.Step();
  EXPECT_EQ(solver.awake_part(), 0);
  ExpectEquilibrium(solver);
}

TEST_P(SeveralSolidsUnderGravity, SagAsTheReferenceBesideOneThatIsFolded) {
  const SceneView scene = data_.View();
  AccurateUnderTest solver(scene);
  // Fixed where some of its tetrahedra are inverted.
  const Solid lump = data_.solids[kLump];
  for (Index v = lump.first_vertex; v < lump.first_vertex + lump.vertex_count; ++v) {
    Vec3f p = scene.rest_position[v];
    p.x() = 2 * scene.rest_position[lump.first_vertex].x() - p.x();
    solver.Place(v, p);
  }
  for (int i = 0; i < 250; ++i) solver.Step();
  EXPECT_GT(solver.awake_part(), 0);
  ExpectEquilibrium(solver);
}

INSTANTIATE_TEST_SUITE_P(Presets, SeveralSolidsUnderGravity,
                         testing::Values(PhysicsPreset::kFast, PhysicsPreset::kDefault, PhysicsPreset::kAccurate));

}  // namespace
}  // namespace fulcrum::physics
