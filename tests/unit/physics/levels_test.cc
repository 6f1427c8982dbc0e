// Parts of the accurate solver on cases of their own: hats where they are near to each other, the size of the lattice,
// the matrix beside rows that sleep, stiffness queries.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "physics_node/implicit/implicit_solver.h"
#include "physics_node/implicit/workers.h"
#include "tests/support/several_solids.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

using implicit::ImplicitSolver;

struct Tissue {
  explicit Tissue(const SceneView& scene)
      : particles(scene), tissue(scene, &particles), solver(scene, BuildElasticModel(scene), tissue, &particles) {}
  ParticleStore particles;
  TissueModel tissue;
  ImplicitSolver solver;
};

/// A scene of these boxes alone.
scene::SceneData Boxes(const std::vector<scene::SolidBody>& boxes) {
  scene::SceneSettings settings = scene::Small();
  settings.has_organ = false;
  settings.structures.clear();
  settings.script.clear();
  settings.planned_line.clear();
  settings.physics.mode = PhysicsMode::kAccurate;
  settings.physics.gravity = Vec3f::Zero();
  scene::Anatomy anatomy;
  anatomy.solids = boxes;
  return scene::AssembleScene(settings, anatomy);
}

/// By which the blocks of a sheet's hats are scaled, at most and at least.
std::pair<float, float> ScalesOfHats(Index rows, Index cols) {
  const scene::SceneData data = SheetScene(rows, cols);
  const SceneView scene = data.View();
  ParticleStore particles(scene);
  const TissueModel tissue(scene, &particles);
  const ElasticModel elastic = BuildElasticModel(scene);
  const implicit::ImplicitModel model(scene, elastic, particles);
  implicit::Workers workers(1);
  const implicit::SolverContext context{implicit::KernelsFor(), model, particles, workers};
  implicit::SolverState state(scene, elastic, tissue, context);
  const implicit::HatLevel hats = state.coarse.hats();
  const float* const end = hats.scale + hats.rows * hats.slots * kLanes;
  return {*std::max_element(hats.scale, end), *std::min_element(hats.scale, end)};
}

/// Columns of 64 are eight lanes of two groups of four; of 65 a lane ends with a group of one, of 73 with one of two.
/// The same with rows. Sum of squares over two slopes of 1/4 and 1, or 1/2, in place of 1/4.
TEST(Hats, AreScaledWhereTheNextOneIsNear) {
  EXPECT_EQ(ScalesOfHats(65, 64), std::pair(1.0f, 1.0f));
  EXPECT_GE(ScalesOfHats(65, 65).first, 2.5f);
  EXPECT_GE(ScalesOfHats(65, 73).first, 1.5f);
  EXPECT_GE(ScalesOfHats(66, 64).first, 2.5f);
  EXPECT_GE(ScalesOfHats(67, 64).first, 1.5f);
}

/// Time and memory of the factor grow with the square of the number.
TEST(Lattice, OfALargeOrganHasNotManyNodes) {
  const scene::SceneData data = Boxes({Box("large", Vec3d::Zero(), {0.26, 0.18, 0.13}, {12, 10, 8}, 5e4)});
  const SceneView scene = data.View();
  const ParticleStore particles(scene);
  const implicit::CoarseSpace coarse(scene, BuildElasticModel(scene), particles, implicit::KernelsFor());
  EXPECT_GT(coarse.nodes(), 100);
  EXPECT_LE(coarse.nodes(), 480);
}

/// What edges of the row above, which sleeps, do to a row is in the matrix as it is now.
TEST(Springs, OfARowAboveThatSleepsAreLinearised) {
  constexpr Index kRows = 17, kCols = 17;
  constexpr int kFirst = implicit::Partition::kRows, kEnd = 2 * kFirst;
  scene::SceneData data = SheetScene(kRows, kCols);
  data.fixed.physics.mode = PhysicsMode::kAccurate;
  data.fixed.physics.membrane_model = MembraneModel::kSprings;
  const SceneView scene = data.View();
  ParticleStore particles(scene);
  const TissueModel tissue(scene, &particles);
  const ElasticModel elastic = BuildElasticModel(scene);
  const implicit::ImplicitModel model(scene, elastic, particles);
  implicit::Workers workers(1);
  const implicit::SolverContext context{implicit::KernelsFor(), model, particles, workers};
  implicit::SolverState state(scene, elastic, tissue, context);
  implicit::SolverScratch scratch(context, state.coarse.row_width());
  implicit::Linearisation& at = state.linearisation;
  for (Index r = 0; r < kRows; ++r) {  // A tenth longer along the columns than at rest.
    for (Index c = 0; c < kCols; ++c) {
      const Vec3f x = scene.rest_position[r * kCols + c];
      PutField(at.point.data(), particles.NodeRef(r, c), Vec3f(x.x(), 1.1f * x.y(), 0));
    }
  }
  const implicit::Inertia inertia = model.InertiaOf(0.005f);
  const implicit::LinearSystem system(context, inertia.inertia, &state, &scratch);
  const implicit::SheetFields fields = SheetFieldsAt(context, state, at.point, &at.residual);
  const auto linearise = [&](bool above, int first) {
    for (std::size_t d = 0; d < 3; ++d) {
      std::fill_n(at.kt[d].data(), at.kt[d].size(), 0.0f);
      std::fill_n(at.along[d].data(), at.along[d].size(), 0.0f);
    }
    context.kernels.sheet.linearise(system.sheet, inertia, fields, system.sheet_matrix, scratch.carry[0].data(), above,
                                    first, kEnd);
    std::vector<float> row;
    for (std::size_t d = 1; d < 3; ++d) {
      for (const FloatArray* plane : {&at.kt[d], &at.along[d]}) {
        const float* const start = plane->data() + model.layout.stride * (kFirst - 1);
        row.insert(row.end(), start, start + model.layout.stride);
      }
    }
    return row;
  };
  const std::vector<float> whole = linearise(false, 0), part = linearise(true, kFirst);
  EXPECT_GT(*std::max_element(whole.begin(), whole.end()), 0.0f);
  EXPECT_EQ(part, whole);
}

/// Where all that can move is held, nothing is left whose mass could resist.
TEST(StiffnessQuery, DoesNotContainTheMassOfWhatIsMoved) {
  scene::SolidBody box = Box("box", Vec3d::Zero(), {0.06, 0.06, 0.03}, {3, 3, 2}, 3e4);
  Fix(&box, [](const Vec3d& p) { return p.z() < 1e-6; });
  const scene::SceneData data = Boxes({box});
  const SceneView scene = data.View();
  Tissue tissue(scene);
  std::vector<ParticleRef> at;
  for (Index v = 0; v < scene.tube_vertex_count; ++v) {
    if (scene.inverse_mass[v] > 0.0f) at.push_back(tissue.particles.Ref(v));
  }
  tissue.solver.BeginStep();
  (void)tissue.solver.Substep(0.005f, 2, {}, {});
  float at_rest = 0, in_a_frame = 0;
  ASSERT_TRUE(tissue.solver.Stiffness({at, Vec3f::UnitZ(), 0, 0}, &at_rest));
  ASSERT_TRUE(tissue.solver.Stiffness({at, Vec3f::UnitZ(), 0.01f, 1}, &in_a_frame));
  EXPECT_NEAR(in_a_frame, at_rest, 1e-3f * at_rest);
}

}  // namespace
}  // namespace fulcrum::physics
