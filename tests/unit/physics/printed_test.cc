// Mode paper as printed: a test for each row of the paper that concerns the tissue (deploy/docs/measurements/paper).
// The numbers are the paper's, not those of the code.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "physics_node/pbd/printed_formulas.h"
#include "physics_node/pbd/printed_solver.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

using printed::Points;
using printed::Vec;

/// Four free nodes in a square of 2 mm, 1 m above one tetrahedron with legs of 20 mm; no edge.
scene::SceneData OneTetrahedron() {
  scene::SceneData data = SheetScene(2, 2);
  for (Vec3f& p : data.rest_position) p.z() += 1;
  std::fill(data.membrane_rest_length.begin(), data.membrane_rest_length.end(), 0.0f);
  const std::array<Vec3f, 4> organ{Vec3f(0, 0, 0), Vec3f(0.02f, 0, 0), Vec3f(0, 0.02f, 0), Vec3f(0, 0, 0.02f)};
  data.rest_position.insert(data.rest_position.begin(), organ.begin(), organ.end());
  data.inverse_mass.assign(8, 1.0f);
  data.fixed.tube_vertex_count = data.fixed.membrane.first = 4;
  data.tets = {{0, 1, 2, 3}};
  data.tet_colours = {0, 1};
  data.tube_surface = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  data.fixed.physics.as = PaperForm::kPrinted;
  return data;
}

struct World {
  explicit World(const scene::SceneData& data)
      : view(data.View()), particles(view), model(view, &particles), solver(view, &model, &particles) {}
  [[nodiscard]] Vec At(Index particle) const { return particles.At(particles.Ref(particle)).cast<double>(); }
  void Put(Index particle, const Vec& p) { particles.Set(particles.Ref(particle), p.cast<float>()); }
  SceneView view;
  ParticleStore particles;
  TissueModel model;
  PrintedSolver solver;
};

/// A simulation whose particles start at `now` and were at `before` a step ago.
void Start(const std::vector<Vec3f>& now, const std::vector<Vec3f>& before, TissueSimulation* simulation) {
  std::vector<float> x, last;
  for (const Vec3f& p : now) x.insert(x.end(), {p.x(), p.y(), p.z()});
  for (const Vec3f& p : before) last.insert(last.end(), {p.x(), p.y(), p.z()});
  ASSERT_TRUE(simulation->Restore(x, last, simulation->Save()));
}

TEST(PaperTable1, TheStepIs02Seconds) {
  scene::SceneData data = OneTetrahedron();
  data.fixed.physics.gravity = Vec3f(0, 0, -0.1f);
  TissueSimulation simulation(data.View());
  (void)simulation.Step({});
  EXPECT_NEAR(1 - simulation.particles().At(simulation.particles().Ref(7)).z(), 0.1 * 0.2 * 0.2, 1e-6);
}

TEST(PaperTable1, ThreeIterationsOfStretchAt03) {
  scene::SceneData data = OneTetrahedron();
  data.membrane_rest_length[0] = 0.002f;
  TissueSimulation simulation(data.View());
  std::vector<Vec3f> x = data.rest_position;
  x[5].x() += 0.001f;
  Start(x, x, &simulation);
  (void)simulation.Step({});
  const ParticleStore& particles = simulation.particles();
  const double length = (particles.At(particles.Ref(5)) - particles.At(particles.Ref(4))).norm();
  EXPECT_NEAR((length - 0.002) / 0.001, 0.7 * 0.7 * 0.7, 1e-3);
}

TEST(PaperTable1, VolumeAt09) {
  World world(OneTetrahedron());
  for (Index v = 0; v < 4; ++v) world.Put(v, 1.002 * world.At(v));
  const auto excess = [&] {
    return printed::VolumeOf({world.At(0), world.At(1), world.At(2), world.At(3)}) - std::pow(0.02, 3) / 6;
  };
  const double before = excess();
  world.solver.Iterate();
  EXPECT_NEAR(excess() / before, 0.1, 0.005);
}

TEST(PaperTable1, BendingAt065) {
  scene::SceneData data = OneTetrahedron();
  data.bending = {{{4, 7, 6, 5}, 0.0f}};
  data.bending_colours = {0, 1};
  World world(data);
  const auto angle = [&] { return printed::AngleOf({world.At(4), world.At(7), world.At(6), world.At(5)}); };
  const double rest = angle();
  world.Put(5, world.At(5) + Vec(0, 0, 2e-4));
  world.Put(6, world.At(6) + Vec(1e-5, 0, 0));
  const double before = angle() - rest;
  world.solver.Iterate();
  EXPECT_NEAR((angle() - rest) / before, 0.35, 0.03);
}

TEST(PaperTable3, CountsOfTheBuiltInScene) {
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  ParticleStore particles(data.View());
  const ConstraintCounts counts = TissueModel(data.View(), &particles).counts();
  EXPECT_NEAR(static_cast<double>(counts.vertices), 20556, 0.02 * 20556);
  EXPECT_NEAR(static_cast<double>(counts.stretch), 65279, 0.02 * 65279);
  EXPECT_NEAR(static_cast<double>(counts.volume), 6105, 0.02 * 6105);
  EXPECT_NEAR(static_cast<double>(counts.bending), 1853, 0.02 * 1853);
}

TEST(PaperTable4, TetrahedraOfTheBuiltInScene) {
  EXPECT_NEAR(static_cast<double>(scene::BuildProcedural(scene::BuiltIn()).tets.size()), 6000, 0.02 * 6000);
}

TEST(PaperEquation1, IsTheLengthBeyondRest) {
  EXPECT_DOUBLE_EQ(printed::StretchOf({Vec(0, 0, 0), Vec(3, 4, 0)}, 2), 3);
}

TEST(PaperEquation2, IsASixthOfTheTripleProduct) {
  EXPECT_DOUBLE_EQ(printed::VolumeOf({Vec(1, 1, 1), Vec(3, 1, 1), Vec(1, 4, 1), Vec(1, 1, 5)}), 4);
}

/// p3 at right angles to the edge p1 p2, p4 turned from it by the angle; with `skew` p3 is 45 degrees from the edge.
Points<4> Fold(double angle, bool skew = false) {
  return {Vec(0, 0, 0), Vec(1, 0, 0), Vec(skew ? 1 : 0, 1, 0), Vec(0, std::cos(angle), std::sin(angle))};
}

TEST(PaperEquation3And8, TheAngleIsThatOfTheNormalsWhereTheAnglesAtP1AreRight) {
  for (const double angle : {0.3, 1.0, 2.5}) {
    EXPECT_NEAR(printed::AngleOf(Fold(angle)), angle, 1e-12);
    EXPECT_NEAR(printed::AngleOf(Fold(-angle)), angle, 1e-12) << "both senses of a fold";
  }
}

TEST(PaperA5, DividesByLengthsAndNotByTheCrossProduct) {
  EXPECT_NEAR(printed::CosineOf(Fold(0.3, true)), std::cos(0.3) / std::sqrt(2.0), 1e-12);
}

/// One constraint after the other, each in both senses, each with the places that the last one has left.
TEST(PaperEquations4To7, AreProjectedOneAfterTheOther) {
  scene::SceneData data = OneTetrahedron();
  data.membrane_rest_length[0] = 0.001f;  // Stretched.
  data.membrane_rest_length[1] = 0.003f;  // Compressed.
  World world(data);
  const Vec corner = world.At(4);
  world.solver.Iterate();
  // x of the corner moves by half of 0.3 of 1 mm; then the other edge is a little oblique.
  const Vec first = corner + Vec(0.15e-3, 0, 0), other = Vec(0, 0.002, 1);
  const Vec d = first - other;
  const Vec second = first - 0.5 * 0.3 * (d.norm() - 0.003) * d.normalized();
  EXPECT_NEAR((world.At(4) - second).norm(), 0, 2e-7);
  EXPECT_NEAR(world.At(5).x(), 0.002 - 0.15e-3, 1e-7);
}

TEST(PaperEquation6, CorrectionsAreInverseToTheMasses) {
  scene::SceneData data = OneTetrahedron();
  data.membrane_rest_length[0] = 0.001f;
  data.inverse_mass[5] = 3;
  World world(data);
  world.solver.Iterate();
  EXPECT_NEAR(world.At(4).x(), 0.25 * 0.3e-3, 1e-8);
  EXPECT_NEAR(world.At(5).x(), 0.002 - 0.75 * 0.3e-3, 1e-8);
}

TEST(PaperIntegration, IsExplicitEulerWithoutDamping) {
  const scene::SceneData data = OneTetrahedron();
  TissueSimulation simulation(data.View());
  std::vector<Vec3f> before = data.rest_position;
  before[7].x() -= 0.001f;
  Start(data.rest_position, before, &simulation);
  for (int n = 1; n <= 3; ++n) {
    (void)simulation.Step({});
    EXPECT_NEAR(simulation.particles().At(simulation.particles().Ref(7)).x(), 0.002 + 0.001 * n, 1e-6);
  }
}

TEST(PaperEquation9, IsDistanceLessAgreementOfTheNormalsWithinReach) {
  const Vec up(0, 0, 1), p(0, 0, 0.004), q(0, 0, 0);
  EXPECT_NEAR(printed::LinkCost(p, up, q, up), 4 - 1, 1e-12);
  EXPECT_NEAR(printed::LinkCost(p, up, q, -up), 4 + 1, 1e-12);
  EXPECT_TRUE(std::isinf(printed::LinkCost(Vec(0, 0, 0.0151), up, q, up)));
}

/// The only vertex within reach is the tip of the tetrahedron; there is none once that is lowered.
TEST(PaperEquation9, EveryNodeSearchesAVertex) {
  scene::SceneData data = OneTetrahedron();
  for (Index node = 4; node < 8; ++node) data.rest_position[node].z() = 0.03f + 0.0005f * static_cast<float>(node);
  World world(data);
  ASSERT_EQ(world.solver.links().size(), 4u);
  for (const PrintedSolver::Link& link : world.solver.links()) {
    EXPECT_EQ(link.vertex, 3u);
    EXPECT_NEAR(link.rest, (data.rest_position[4 + link.node] - data.rest_position[3]).norm(), 1e-7);
  }
  data.rest_position[3].z() = 0.008f;
  EXPECT_TRUE(World(data).solver.links().empty());
}

TEST(PaperEquation9, ALinkIsASpringOfTheSameStiffness) {
  scene::SceneData data = OneTetrahedron();
  for (Index node = 4; node < 8; ++node) data.rest_position[node].z() = 0.03f;
  for (Index v = 0; v < 4; ++v) data.inverse_mass[v] = 0;
  World world(data);
  world.Put(4, world.At(4) + Vec(0, 0, 1e-3));
  world.solver.Iterate();
  EXPECT_NEAR(world.At(4).z(), 0.03 + 0.7e-3, 2e-6);
}

TEST(PaperA1A2, BothEndsMoveAlongTheEdgeByTheirShare) {
  Points<2> p{Vec(0, 0, 0), Vec(3, 4, 0)};
  printed::ProjectStretch({1, 3}, 2, 1, &p);
  EXPECT_NEAR((p[0] - 0.75 * Vec(0.6, 0.8, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((p[1] - Vec(3, 4, 0) + 2.25 * Vec(0.6, 0.8, 0)).norm(), 0, 1e-12);
}

TEST(PaperA3, MovesAlongTheGradientsByMass) {
  Points<4> p{Vec(0, 0, 0), Vec(1, 0, 0), Vec(0, 1, 0), Vec(0, 0, 1)};
  printed::ProjectVolume({1, 1, 1, 1}, 0.2, 1, &p);
  EXPECT_NEAR((p[1] - Vec(1 + 1.0 / 30, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((p[0] + Vec(1, 1, 1) / 30).norm(), 0, 1e-12);
  p = {Vec(0, 0, 0), Vec(1, 0, 0), Vec(0, 1, 0), Vec(0, 0, 1)};
  printed::ProjectVolume({0, 2, 0, 0}, 0.2, 1, &p);
  EXPECT_NEAR((p[1] - Vec(1.2, 0, 0)).norm(), 0, 1e-12) << "the one free vertex takes all of it";
}

/// By hand, with right angles at p1: p3 moves by (angle - rest) / (4 - 2 cos(angle)) towards p4.
TEST(PaperA4, FoldsByThePrintedFactor) {
  Points<4> p = Fold(1.0);
  printed::ProjectBending({1, 1, 1, 1}, 0.8, 1, &p);
  EXPECT_NEAR((p[2] - Vec(0, 1, 0.2 / (4 - 2 * std::cos(1.0)))).norm(), 0, 1e-12);
  // 4 w_i over the sum of the masses, times the sum of the squares: with one heavy vertex not what Mueller et al. 2007
  // prints.
  p = Fold(1.0);
  printed::ProjectBending({1, 1, 3, 1}, 0.8, 1, &p);
  EXPECT_NEAR((p[2] - Vec(0, 1, 0.2 * 4 * 3 / 6 / (4 - 2 * std::cos(1.0)))).norm(), 0, 1e-12);
}

TEST(PaperAsPrinted, DirectionsOfA4AreMinusTheGradientOfA5) {
  const Points<4> p{Vec(0.1, 0.2, 0), Vec(1, 0.1, 0.3), Vec(0.4, 0.9, -0.2), Vec(0.3, -0.8, 0.5)};
  const Points<4> q = printed::BendingDirections(p);
  for (int i = 0; i < 4; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      Points<4> low = p, high = p;
      low[i][axis] -= 1e-6;
      high[i][axis] += 1e-6;
      EXPECT_NEAR(q[i][axis], -(printed::CosineOf(high) - printed::CosineOf(low)) / 2e-6, 1e-8);
    }
  }
}

/// Formulas that are 0/0 somewhere leave the particles where they are.
TEST(PaperAsPrinted, ZeroLengthsMoveNothing) {
  Points<2> edge{Vec(1, 1, 1), Vec(1, 1, 1)};
  printed::ProjectStretch({1, 1}, 0.1, 1, &edge);
  EXPECT_EQ(edge[0], Vec(1, 1, 1));
  Points<4> flat{Vec(0, 0, 0), Vec(0, 0, 0), Vec(0, 0, 0), Vec(0, 0, 0)};
  printed::ProjectBending({1, 1, 1, 1}, 1, 1, &flat);
  printed::ProjectVolume({0, 0, 0, 0}, 1, 1, &flat);
  EXPECT_EQ(flat[3], Vec(0, 0, 0));
}

}  // namespace
}  // namespace fulcrum::physics
