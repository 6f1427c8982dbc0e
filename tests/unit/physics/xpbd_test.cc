// Small-step XPBD: equal bits on all instruction sets, equilibrium at rest, forces equal to the gradient of the energy,
// convergence with substeps.
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "physics_node/xpbd/xpbd_solver.h"
#include "services/scene/builder/build.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics::xpbd {
namespace {

struct Body {
  explicit Body(const SceneView& view, InstructionSet set = BestInstructionSet())
      : Body(view, BuildElasticModel(view), set) {}
  Body(const SceneView& view, const ElasticModel& model, InstructionSet set)
      : scene(view),
        particles(view),
        tissue(view, &particles),
        elastic(model),
        solver(elastic, &tissue, &particles, KernelsFor(set), physics::tissue::KernelsFor(set)) {}
  void Substep(float h) {
    resets += solver.Predict(h);
    solver.Iterate(h);
    const FinishResult finish = solver.Finish(h);
    resets += finish.resets;
    largest_sq = finish.max_step_sq;
  }
  /// Largest distance from the rest shape [m].
  [[nodiscard]] float Displacement() const {
    float largest = 0;
    for (Index p = 0; p < particles.particle_count(); ++p) {
      largest = std::max(largest, (particles.At(particles.Ref(p)) - scene.rest_position[p]).norm());
    }
    return largest;
  }
  SceneView scene;
  ParticleStore particles;
  TissueModel tissue;
  ElasticModel elastic;
  XpbdSolver solver;
  std::uint32_t resets = 0;
  float largest_sq = 0;
};

SceneView WithPrestrain(SceneView scene) {
  scene.physics.membrane_prestrain = 0.04f;
  scene.physics.membrane_stiffening = 2.0f;
  return scene;
}

void Shake(ParticleStore* particles, float size) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> offset(-size, size);
  for (Index p = 0; p < particles->particle_count(); ++p) {
    const ParticleRef at = particles->Ref(p);
    const Vec3f move(offset(random), offset(random), offset(random));
    if (particles->InverseMass(at) > 0.0f) {
      particles->Set(at, particles->At(at) + move);
    }
  }
}

TEST(Xpbd, AllInstructionSetsGiveTheSameBits) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const SceneView scene = WithPrestrain(data.View());
  Body narrow(scene, InstructionSet::kBaseline);
  Shake(&narrow.particles, 0.0005f);
  std::vector<std::unique_ptr<Body>> bodies;
  for (const InstructionSet set : kInstructionSets) {
    if (!Has(set)) continue;
    bodies.push_back(std::make_unique<Body>(scene, set));
    Shake(&bodies.back()->particles, 0.0005f);
  }
  for (int i = 0; i < 40; ++i) {
    narrow.Substep(5e-4f);
    for (const auto& body : bodies) {
      body->Substep(5e-4f);
      ASSERT_EQ(body->resets, narrow.resets);
      ASSERT_EQ(
          std::memcmp(narrow.particles.raw().data(), body->particles.raw().data(), narrow.particles.raw().size_bytes()),
          0)
          << "substep " << i;
    }
  }
}

TEST(Xpbd, RestIsAtRestAlsoUnderPrestrain) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  for (const SceneView& scene : {data.View(), WithPrestrain(data.View())}) {
    Body body(scene);
    for (int i = 0; i < 400; ++i) {
      body.Substep(5e-4f);
    }
    EXPECT_EQ(body.resets, 0u);
    EXPECT_LT(body.Displacement(), 1e-5f);  // Rounding.
  }
}

/// Elastic energy of the organ as defined in XPBD: stable neo-Hookean on each tet.
double TetEnergy(const ElasticModel& model, const std::vector<Vec3d>& x) {
  double energy = 0;
  for (const ElasticTet& tet : model.tets) {
    Mat3d edges;
    for (int i = 0; i < 3; ++i) {
      edges.col(i) = x[tet.v[static_cast<std::size_t>(i) + 1]] - x[tet.v[0]];
    }
    const Mat3d f = edges * tet.inverse_edges;
    const double j = f.determinant() - 1;
    energy += tet.volume *
              (model.mu_Pa / 2 * (f.squaredNorm() - 3) - model.mu_Pa * j + (model.lambda_Pa + model.mu_Pa) / 2 * j * j);
  }
  return energy;
}

/// A substep so short that it is explicit: it moves each particle by h^2 w times the force. Each constraint separately
/// is then exact, so this checks signs, stiffnesses and gradients against finite differences of the energy.
TEST(Xpbd, ForcesAreThoseOfTheEnergy) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  data.fixed.physics.membrane_Et_N_per_m = 0;  // The organ alone: no membrane, no bindings.
  data.fixed.physics.fat_youngs_modulus_Pa = 0;
  data.fixed.physics.membrane_bending_Nm = 0;
  // The force is small enough to add up in float: masses unchanged, h chosen for moves of about 1e-6 m.
  Body body(data.View());
  Shake(&body.particles, 0.0003f);
  body.solver.Stop();
  std::vector<Vec3d> before;
  for (Index p = 0; p < body.particles.particle_count(); ++p) {
    before.push_back(body.particles.At(body.particles.Ref(p)).cast<double>());
  }
  const float h = 4e-6f;
  body.solver.Iterate(h);
  double error = 0, size = 0;
  for (Index p = 0; p < body.scene.tube_vertex_count; p += 7) {
    const double w = body.scene.inverse_mass[p];
    if (w == 0) {
      continue;
    }
    const Vec3d moved = body.particles.At(body.particles.Ref(p)).cast<double>() - before[p];
    Vec3d expected;
    for (int axis = 0; axis < 3; ++axis) {
      constexpr double kStep = 1e-8;
      std::vector<Vec3d> low = before, high = before;
      low[p][axis] -= kStep;
      high[p][axis] += kStep;
      expected[axis] = -w * h * h * (TetEnergy(body.elastic, high) - TetEnergy(body.elastic, low)) / (2 * kStep);
    }
    error += (moved - expected).squaredNorm();
    size += expected.squaredNorm();
  }
  EXPECT_LT(std::sqrt(error / size), 0.03);  // Float rounding of positions and the implicit part of the step.
}

/// A hanging strip of one column: the top edge carries the whole weight, so the end sinks by sum over edges of (weight
/// below) / (A / L). XPBD converges to that with substeps.
TEST(Xpbd, HangingSheetConvergesWithSubsteps) {
  scene::SceneData data = SheetScene(9, 9);
  data.bending.clear();
  data.bending_colours = {0};
  const float h = 0.002f;
  for (Index r = 0; r < 9; ++r) {
    for (Index c = 0; c < 9; ++c) {
      data.inverse_mass[r * 9 + c] = r == 0 ? 0.0f : 1.0f / (0.5f * h * h);
    }
  }
  SceneView scene = data.View();
  scene.physics.gravity = Vec3f(0, 9.81f, 0);  // Rows go along y.
  scene.physics.membrane_Et_N_per_m = 20.0f;
  scene.physics.damping_per_s = 40.0f;
  double expected = 0;
  ElasticModel model = BuildElasticModel(scene);
  for (std::size_t i = 0; i < model.springs.size(); ++i) {
    if (i % 3 != 1) {
      model.springs[i].axial = 0;  // Columns only.
    }
  }
  const Index middle = 4;
  for (Index r = 0; r + 1 < 9; ++r) {
    const ElasticSpring& spring = model.springs[3 * (r * 9 + middle) + 1];
    expected += (8.0 - r) * 0.5 * h * h * 9.81 / (spring.axial / spring.rest_length);
  }
  std::vector<double> errors;
  for (const int substeps : {16, 64, 256}) {
    Body body(scene, model, BestInstructionSet());
    for (int i = 0; i < 60 * substeps; ++i) {
      body.Substep(0.01f / static_cast<float>(substeps));
    }
    const double sag = body.particles.At(body.particles.Ref(8 * 9 + middle)).y() - 8.0f * h;
    errors.push_back(std::abs(sag - expected) / expected);
  }
  EXPECT_GT(errors[0], 2 * errors[1]);
  EXPECT_GT(errors[1], 2 * errors[2]);
  EXPECT_LT(errors[2], 0.1);
}

TEST(Xpbd, ScrambledTissueStaysFiniteAndComesBack) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  Body body(WithPrestrain(data.View()));
  Shake(&body.particles, 0.004f);
  const ParticleRef damaged = body.particles.Ref(100);
  body.particles.Set(damaged, Vec3f(std::numeric_limits<float>::quiet_NaN(), 0, 0));
  for (int i = 0; i < 3000; ++i) {
    body.Substep(5e-4f);
  }
  EXPECT_GT(body.resets, 0u);
  EXPECT_TRUE(std::isfinite(body.Displacement()));
  EXPECT_LT(body.Displacement(), 0.01f);
}

TEST(Xpbd, CutsTakeEffectAtOnce) {
  const scene::SceneData data = SheetScene(9, 9);
  Body body(data.View());
  TopologyState topology;
  topology.rows = topology.cols = 9;
  topology.dead_nodes.assign(11, 0);
  topology.dead_edges.assign((3 * 81 + 7) / 8, 0);
  topology.shrink.assign(3 * 81, 0);
  // The edge from the middle to the right is cut, all others of the row pair are not: a pull at the middle no longer
  // moves its neighbour in the row.
  SetBit(topology.dead_edges, 3 * (4 * 9 + 4));
  body.tissue.Apply(topology, &body.particles);
  Body whole(data.View());
  float moved[2];
  Body* bodies[2] = {&body, &whole};
  for (int i = 0; i < 2; ++i) {
    const ParticleRef middle = bodies[i]->particles.Ref(4 * 9 + 4), right = bodies[i]->particles.Ref(4 * 9 + 5);
    bodies[i]->particles.SetInverseMass(middle, 0);
    bodies[i]->particles.Set(middle, bodies[i]->particles.At(middle) - Vec3f(0.0005f, 0, 0));
    const Vec3f start = bodies[i]->particles.At(right);
    bodies[i]->Substep(5e-4f);
    moved[i] = (bodies[i]->particles.At(right) - start).norm();
  }
  EXPECT_LT(moved[0], 0.5f * moved[1]);
}

}  // namespace
}  // namespace fulcrum::physics::xpbd
