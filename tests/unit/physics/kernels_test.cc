// The vector kernels give the results of the plain constraints, with equal bits on all instruction sets.
#include "physics_node/pbd/kernels.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "physics_node/pbd/pbd_solver.h"
#include "physics_node/tissue/constraints.h"
#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/scene/builder/build.h"
#include "tests/unit/physics/kernels_scalar.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

/// Error of one projection [m]: coordinates are millimetres to centimetres, so float rounding is far below this.
constexpr float kTolerance = 2e-7f;

void Shake(ParticleStore* particles, float size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> offset(-size, size);
  for (Index p = 0; p < particles->particle_count(); ++p) {
    const ParticleRef at = particles->Ref(p);
    const Vec3f move(offset(random), offset(random), offset(random));
    if (particles->InverseMass(at) > 0.0f) {
      particles->Set(at, particles->At(at) + move);
    }
  }
}

struct Body {
  explicit Body(const SceneView& view) : scene(view), particles(view), model(view, &particles) {}
  SceneView scene;
  ParticleStore particles;
  TissueModel model;
};

std::vector<float> Positions(const ParticleStore& particles) {
  std::vector<float> xyz(3 * std::size_t{particles.particle_count()});
  particles.CopyPositions(xyz);
  return xyz;
}

float LargestDifference(const std::vector<float>& a, const std::vector<float>& b) {
  float largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::abs(a[i] - b[i]));
  }
  return largest;
}

/// One plain projection of `indices` in place.
template <int N, class Constraint>
void ProjectPlain(ParticleStore* particles, const std::array<Index, N>& indices, float k,
                  const Constraint& constraint) {
  std::array<V3<double>, N> x;
  std::array<double, N> w;
  for (int i = 0; i < N; ++i) {
    x[i] = particles->At(particles->Ref(indices[i])).template cast<double>();
    w[i] = particles->InverseMass(particles->Ref(indices[i]));
  }
  Project<double, N>(constraint(x), w, k, &x);
  for (int i = 0; i < N; ++i) {
    particles->Set(particles->Ref(indices[i]), x[i].template cast<float>());
  }
}

TEST(GridLayout, HasAPlaceOfItsOwnForEachNode) {
  for (const std::uint32_t cols : {2u, 7u, 8u, 9u, 16u, 61u, 64u}) {
    const GridLayout layout(5, cols);
    std::vector<bool> used(layout.plane(), false);
    for (std::uint32_t r = 0; r < 5; ++r) {
      for (std::uint32_t c = 0; c < cols; ++c) {
        const std::uint32_t at = layout.Offset(r, c);
        ASSERT_LT(at, layout.plane());
        EXPECT_FALSE(used[at]);
        used[at] = true;
      }
    }
  }
}

TEST(ParticleStore, KeepsSceneOrder) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const SceneView view = data.View();
  ParticleStore particles(view);
  const std::vector<float> xyz = Positions(particles);
  ASSERT_EQ(xyz.size(), 3 * view.rest_position.size());
  for (Index p = 0; p < particles.particle_count(); ++p) {
    EXPECT_EQ(Vec3f(xyz[3 * p], xyz[3 * p + 1], xyz[3 * p + 2]), view.rest_position[p]);
    EXPECT_EQ(particles.InverseMass(particles.Ref(p)), view.inverse_mass[p]);
  }
}

/// The order of GridStretch: even row pairs (along both rows by even, odd and wrapping slots; straight; diagonal),
/// then the odd row pairs.
void SweepPlain(Body* body, float k) {
  const GridLayout& layout = body->particles.layout();
  const int rows = static_cast<int>(layout.rows), cols = static_cast<int>(layout.cols);
  const int slots = static_cast<int>(layout.slots);
  const auto project = [&](int r, int c, int direction) {
    constexpr int kStep[3][2] = {{0, 1}, {1, 0}, {1, 1}};
    const int r2 = r + kStep[direction][0], c2 = c + kStep[direction][1];
    if (r2 < rows && c2 < cols) {
      const float rest = body->model.rest(direction)[layout.Offset(static_cast<Index>(r), static_cast<Index>(c))];
      const auto node = [&](int rr, int cc) { return body->scene.membrane.first + static_cast<Index>(rr * cols + cc); };
      ProjectPlain<2>(&body->particles, {node(r, c), node(r2, c2)}, k,
                      [&](const auto& x) { return Stretch<double>(x[0], x[1], rest); });
    }
  };
  const auto along = [&](int r) {
    if (slots == 1) {
      for (int first = 0; first < 2; ++first) {
        for (int c = first; c < cols; c += 2) {
          project(r, c, 0);
        }
      }
      return;
    }
    for (int pass = 0; pass < 3; ++pass) {
      for (int c = 0; c < cols; ++c) {
        const int slot = c % slots;
        if (pass == 2 ? slot == slots - 1 : slot % 2 == pass && slot != slots - 1) {
          project(r, c, 0);
        }
      }
    }
  };
  const auto between = [&](int r) {
    for (int direction = 1; direction < 3; ++direction) {
      for (int c = 0; c < cols; ++c) {
        project(r, c, direction);
      }
    }
  };
  for (int r = 0; r < rows; r += 2) {
    along(r);
    if (r + 1 < rows) {
      along(r + 1);
      between(r);
    }
  }
  for (int r = 1; r + 1 < rows; r += 2) {
    between(r);
  }
}

class GridStretch : public testing::TestWithParam<std::pair<std::uint32_t, std::uint32_t>> {};

TEST_P(GridStretch, IsTheGaussSeidelSweepThatItSays) {
  const auto [rows, cols] = GetParam();
  const scene::SceneData data = SheetScene(rows, cols);
  Body plain(data.View()), vector(data.View());
  Shake(&plain.particles, 0.0007f, 5);
  Shake(&vector.particles, 0.0007f, 5);
  SweepPlain(&plain, 0.9f);
  const GridLayout& layout = vector.particles.layout();
  const GridArrays grid{vector.particles.plane(0),
                        vector.particles.plane(1),
                        vector.particles.plane(2),
                        vector.particles.plane(3),
                        {vector.model.rest(0), vector.model.rest(1), vector.model.rest(2)},
                        static_cast<int>(layout.rows),
                        static_cast<int>(layout.slots)};
  pbd::KernelsFor().grid_stretch(grid, 0.9f);
  EXPECT_LT(LargestDifference(Positions(plain.particles), Positions(vector.particles)), kTolerance);
}

INSTANTIATE_TEST_SUITE_P(Sizes, GridStretch,
                         testing::Values(std::pair{6u, 5u}, std::pair{7u, 8u}, std::pair{5u, 9u}, std::pair{9u, 23u},
                                         std::pair{8u, 40u}, std::pair{12u, 64u}));

TEST(Kernels, SpringsVolumesBendingBindingsMatchThePlainConstraints) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const SceneView view = data.View();
  constexpr float k = 0.6f;
  const pbd::Kernels& kernels = pbd::KernelsFor();
  {
    Body plain(view), vector(view);
    Shake(&plain.particles, 0.0004f, 6);
    Shake(&vector.particles, 0.0004f, 6);
    for (const StretchConstraint& edge : view.tube_edges) {
      ProjectPlain<2>(&plain.particles, {edge.a, edge.b}, k,
                      [&](const auto& x) { return Stretch<double>(x[0], x[1], edge.rest_length); });
    }
    kernels.springs(vector.particles.tube(), vector.model.springs().data(), vector.model.springs().size(), k);
    EXPECT_LT(LargestDifference(Positions(plain.particles), Positions(vector.particles)), 10 * kTolerance);
  }
  {
    Body plain(view), vector(view);
    Shake(&plain.particles, 0.0004f, 7);
    Shake(&vector.particles, 0.0004f, 7);
    for (const Tetrahedron& tet : view.tets) {
      std::array<V3<double>, 4> rest;
      for (int i = 0; i < 4; ++i) {
        rest[i] = view.rest_position[tet[i]].cast<double>();
      }
      const double volume = Volume<double>(rest, 0.0).value;
      ProjectPlain<4>(&plain.particles, tet, k, [&](const auto& x) { return Volume<double>(x, volume); });
    }
    kernels.volumes(vector.particles.tube(), vector.model.tets().data(), vector.model.tets().size(), k);
    EXPECT_LT(LargestDifference(Positions(plain.particles), Positions(vector.particles)), 10 * kTolerance);
  }
  {
    Body plain(view), vector(view);
    Shake(&plain.particles, 0.0004f, 8);
    Shake(&vector.particles, 0.0004f, 8);
    for (const BendingConstraint& hinge : view.bending) {
      ProjectPlain<4>(&plain.particles, hinge.v, k,
                      [&](const auto& x) { return Bending<double>(x, hinge.rest_angle); });
    }
    PhysicsParams params = view.physics;
    params.k_bending = k;
    PbdSolver(params, &vector.model, &vector.particles).Bend();
    EXPECT_LT(LargestDifference(Positions(plain.particles), Positions(vector.particles)), 10 * kTolerance);
  }
  {
    // Only the stretched side: the membrane is well above the organ.
    Body plain(view), vector(view);
    for (Body* body : {&plain, &vector}) {
      for (Index p = view.membrane.first; p < body->particles.particle_count(); ++p) {
        body->particles.Set(body->particles.Ref(p), body->particles.At(body->particles.Ref(p)) + Vec3f(0, 0, 0.01f));
      }
    }
    for (const Binding& binding : view.bindings) {
      ProjectPlain<4>(&plain.particles, {binding.membrane, binding.surface[0], binding.surface[1], binding.surface[2]},
                      k, [&](const auto& x) {
                        const auto& b = binding.barycentric;
                        return Bind<double>(x, {b[0], b[1], b[2]}, binding.rest_length);
                      });
    }
    kernels.bindings(vector.particles.pool(), vector.model.bindings().data(), vector.model.bindings().size(),
                     {k, 0.0f, 0.0f});
    EXPECT_LT(LargestDifference(Positions(plain.particles), Positions(vector.particles)), 10 * kTolerance);
  }
}

TEST(Bindings, DoNotLetTheOrganThroughTheMembrane) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const SceneView view = data.View();
  Body body(view);
  for (Index p = view.membrane.first; p < body.particles.particle_count(); ++p) {
    const ParticleRef at = body.particles.Ref(p);
    if (body.particles.InverseMass(at) > 0.0f) {
      body.particles.Set(at, body.particles.At(at) - Vec3f(0, 0, 0.006f));  // Into the wall of the organ.
    }
  }
  for (int i = 0; i < 20; ++i) {
    pbd::KernelsFor().bindings(body.particles.pool(), body.model.bindings().data(), body.model.bindings().size(),
                               {0.01f, 0.1f, 0.3f});
  }
  for (const BindingBatch& batch : body.model.bindings()) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (batch.active[lane] == 0.0f || body.particles.InverseMass({batch.base[0][lane], batch.step[0][lane]}) == 0) {
        continue;
      }
      const auto at = [&](int j) { return body.particles.At({batch.base[j][lane], batch.step[j][lane]}); };
      const Vec3f n = (at(2) - at(1)).cross(at(3) - at(1)).normalized();
      EXPECT_GE(n.dot(at(0) - at(1)), 0.29f * batch.rest_height[lane]);
    }
  }
}

TEST(Kernels, AtRestNothingMoves) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  Body body(data.View());
  PbdSolver solver(data.View().physics, &body.model, &body.particles);
  for (int i = 0; i < 200; ++i) {
    solver.Predict();
    for (int k = 0; k < 3; ++k) {
      solver.Iterate();
    }
    EXPECT_EQ(solver.Finish().resets, 0u);
  }
  Body rest(data.View());
  EXPECT_LT(LargestDifference(Positions(rest.particles), Positions(body.particles)), 2e-6f);
}

/// The kernels of each instruction set against the plain loops, on a step with all constraints.
class SameBits : public testing::TestWithParam<InstructionSet> {
 protected:
  static void Compare(const SceneView& view, InstructionSet set) {
    Body a(view), b(view);
    Shake(&a.particles, 0.002f, 9);
    Shake(&b.particles, 0.002f, 9);
    // A particle that is too fast and a damaged one exercise the rare branches.
    for (Body* body : {&a, &b}) {
      const ParticleRef thrown = body->particles.Ref(view.membrane.first + view.membrane.cols * 2 + 2);
      body->particles.Set(thrown, Vec3f(0.5f, 0, 0));
      body->particles.SetPrevious(thrown, Vec3f(0.48f, 0, 0));
      if (view.tube_vertex_count > 0) {
        body->particles.Set({4 * 61, 1}, Vec3f(0, std::numeric_limits<float>::quiet_NaN(), 0));
      }
    }
    PhysicsParams params = view.physics;
    params.gravity = Vec3f(0.3f, -0.2f, -9.81f);
    PbdSolver oracle(params, &a.model, &a.particles, scalar::kConstraints, scalar::kMotion);
    PbdSolver vector(params, &b.model, &b.particles, pbd::KernelsFor(set), tissue::KernelsFor(set));
    for (int i = 0; i < 30; ++i) {
      EXPECT_EQ(oracle.Predict(), vector.Predict());
      for (int k = 0; k < 2; ++k) {
        oracle.Iterate();
        vector.Iterate();
      }
      const FinishResult x = oracle.Finish(), y = vector.Finish();
      EXPECT_EQ(x.max_step_sq, y.max_step_sq);
      EXPECT_EQ(x.resets, y.resets);
      ASSERT_EQ(std::memcmp(a.particles.raw().data(), b.particles.raw().data(), a.particles.raw().size_bytes()), 0)
          << pbd::KernelsFor(set).name << ", step " << i;
    }
  }
};

TEST_P(SameBits, AsThePlainLoops) {
  if (!Has(GetParam())) GTEST_SKIP() << "this CPU has no " << pbd::KernelsFor(GetParam()).name;
  const scene::SceneData organ = scene::BuildProcedural(scene::Small());
  Compare(organ.View(), GetParam());
  // One slot a row; an odd and an even number of them.
  for (const std::uint32_t cols : {7u, 23u, 30u, 64u}) {
    const scene::SceneData sheet = SheetScene(9, cols);
    Compare(sheet.View(), GetParam());
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, SameBits, testing::ValuesIn(kInstructionSets));

TEST(Quarantine, WhatIsNotFiniteGoesBackAndNothingSpreads) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  Body body(data.View());
  PbdSolver solver(data.View().physics, &body.model, &body.particles);
  const Index node = data.View().membrane.first + 30 * 25 + 12;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  for (const auto& [particle, damage] :
       {std::pair{node, Vec3f(nan, 0, 0)}, {Index{60}, Vec3f(0, inf, 0)}, {node, Vec3f(1e30f, -1e30f, 0)}}) {
    // Between two steps …
    body.particles.Set(body.particles.Ref(particle), damage);
    std::uint32_t resets = solver.Predict();
    // … and within one.
    body.particles.Set(body.particles.Ref(particle), damage);
    solver.Iterate();
    resets += solver.Finish().resets;
    EXPECT_GE(resets, 2u);
    for (const float v : Positions(body.particles)) {
      ASSERT_TRUE(std::isfinite(v));
    }
  }
  for (int i = 0; i < 300; ++i) {
    solver.Predict();
    for (int k = 0; k < 3; ++k) {
      solver.Iterate();
    }
    EXPECT_EQ(solver.Finish().resets, 0u) << "step " << i;
  }
  Body rest(data.View());
  EXPECT_LT(LargestDifference(Positions(rest.particles), Positions(body.particles)), 0.005f);
}

TEST(Quarantine, WhatIsTooFastIsCutShortAndStillArrives) {
  const scene::SceneData data = SheetScene(5, 5);
  Body body(data.View());
  PbdSolver solver(data.View().physics, &body.model, &body.particles);
  const ParticleRef middle = body.particles.Ref(12);
  body.particles.Set(middle, Vec3f(0.004f, 0.004f, 0.5f));
  body.particles.SetPrevious(middle, Vec3f(0.004f, 0.004f, 0.5f));
  std::uint32_t resets = 0;
  for (int i = 0; i < 200; ++i) {
    solver.Predict();
    solver.Iterate();
    resets += solver.Finish().resets;
  }
  EXPECT_GT(resets, 5u);
  EXPECT_LT(std::abs(body.particles.At(middle).z()), 0.002f);
}

}  // namespace
}  // namespace fulcrum::physics
