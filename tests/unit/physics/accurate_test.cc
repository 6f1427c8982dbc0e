// The accurate solver: same bits on every instruction set, rest, pull and return, cuts, damaged input.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "physics_node/accurate/accurate_solver.h"
#include "services/scene/build.h"

namespace fulcrum::physics {
namespace {

using accurate::AccurateSolver;
using accurate::HeldPlace;
using accurate::SubstepReport;

constexpr float kH = 0.005f;
constexpr int kIterations = 2;

class Accurate : public testing::Test {
 protected:
  Accurate() : data_(scene::BuildProcedural(scene::Small())), scene_(data_.View()) {}

  struct Run {
    explicit Run(const SceneView& scene, const accurate::Kernels& kernels = accurate::BestKernels(), int threads = 1)
        : particles(scene),
          tissue(scene, &particles),
          solver(scene, BuildElasticModel(scene), tissue, &particles, threads, kernels) {}

    SubstepReport Step(std::span<const HeldPlace> held = {}, std::span<ContactRow> contacts = {}) {
      solver.BeginStep();
      (void)solver.Substep(kH, kIterations, held, contacts);
      return solver.Substep(kH, kIterations, held, contacts);
    }
    std::vector<float> Positions() const {
      std::vector<float> xyz(3 * std::size_t{particles.particle_count()});
      particles.CopyPositions(xyz);
      return xyz;
    }

    ParticleStore particles;
    TissueModel tissue;
    AccurateSolver solver;
  };

  /// A few nodes in the middle of the membrane, held and `up` metres above their place at rest.
  std::vector<HeldPlace> Patch(Run* run, float up) const {
    std::vector<HeldPlace> held;
    const Index rows = scene_.membrane.rows, cols = scene_.membrane.cols;
    for (Index r = rows / 2 - 1; r <= rows / 2 + 1; ++r) {
      for (Index c = cols / 2 - 1; c <= cols / 2 + 1; ++c) {
        const Index particle = scene_.membrane.first + r * cols + c;
        const ParticleRef at = run->particles.Ref(particle);
        run->particles.SetInverseMass(at, 0);
        held.push_back({at, scene_.rest_position[particle] + Vec3f(0, 0, up)});
      }
    }
    return held;
  }
  void Release(Run* run) const {
    for (Index p = 0; p < run->particles.particle_count(); ++p) {
      run->particles.SetInverseMass(run->particles.Ref(p), run->tissue.BaseInverseMass(p));
    }
  }
  float LargestDisplacement(const Run& run) const {
    float largest = 0;
    for (Index p = 0; p < run.particles.particle_count(); ++p) {
      largest = std::max(largest, (run.particles.At(run.particles.Ref(p)) - scene_.rest_position[p]).norm());
    }
    return largest;
  }

  scene::SceneData data_;
  SceneView scene_;
};

TEST_F(Accurate, SameBitsOnEveryInstructionSet) {
  std::vector<const accurate::Kernels*> sets{&accurate::BaselineKernels()};
  if (__builtin_cpu_supports("avx2")) {
    sets.push_back(&accurate::Avx2Kernels());
  }
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) {
    sets.push_back(&accurate::Avx512Kernels());
  }
  std::vector<std::vector<float>> results;
  for (const accurate::Kernels* kernels : sets) {
    Run run(scene_, *kernels);
    for (int i = 0; i < 12; ++i) {
      run.Step(Patch(&run, 0.001f * static_cast<float>(i)));
    }
    results.push_back(run.Positions());
    EXPECT_EQ(results.back(), results.front()) << kernels->name;
  }
}

TEST_F(Accurate, RestShapeIsAtRestInSpiteOfThePrestrain) {
  ASSERT_GT(scene_.physics.membrane_prestrain, 0.0f);
  Run run(scene_);
  for (int i = 0; i < 50; ++i) {
    run.Step();
  }
  EXPECT_LT(LargestDisplacement(run), 1e-5f);
}

TEST_F(Accurate, PulledAndReleasedItComesBack) {
  Run run(scene_);
  for (int i = 0; i < 40; ++i) {
    run.Step(Patch(&run, 0.012f * std::min(1.0f, static_cast<float>(i + 1) / 30.0f)));
  }
  Vec3f force = Vec3f::Zero();
  for (const HeldPlace& held : Patch(&run, 0.012f)) {
    EXPECT_LT((run.particles.At(held.at) - held.place).norm(), 1e-6f);
    force += run.solver.ForceOn(held.at);
  }
  EXPECT_LT(force.z(), -0.05f) << "The tissue pulls down at what holds it up.";
  Release(&run);
  for (int i = 0; i < 200; ++i) {
    run.Step();
  }
  EXPECT_LT(LargestDisplacement(run), 0.0004f);
}

TEST_F(Accurate, CutEdgesCarryNothing) {
  Run whole(scene_), cut(scene_);
  TopologyState topology;
  const std::size_t nodes = scene_.membrane.node_count();
  topology.revision = 1;
  topology.rows = scene_.membrane.rows;
  topology.cols = scene_.membrane.cols;
  topology.dead_nodes.assign((nodes + 7) / 8, 0);
  topology.dead_edges.assign((3 * nodes + 7) / 8, 0);
  topology.shrink.assign(3 * nodes, 0);
  // All around the patch that is held.
  const Index rows = scene_.membrane.rows, cols = scene_.membrane.cols;
  for (Index r = rows / 2 - 3; r <= rows / 2 + 3; ++r) {
    for (Index c = cols / 2 - 3; c <= cols / 2 + 3; ++c) {
      const bool rim = r == rows / 2 - 3 || r == rows / 2 + 3 || c == cols / 2 - 3 || c == cols / 2 + 3;
      for (Index d = 0; d < 3 && rim; ++d) {
        SetBit(topology.dead_edges, 3 * (r * cols + c) + d);
      }
    }
  }
  ASSERT_GT(cut.tissue.Apply(topology, &cut.particles), 0);
  cut.solver.Follow(cut.tissue);
  for (int i = 0; i < 40; ++i) {
    whole.Step(Patch(&whole, 0.0002f * static_cast<float>(i)));
    cut.Step(Patch(&cut, 0.0002f * static_cast<float>(i)));
  }
  const auto pull = [&](Run* run) {
    float force = 0;
    for (const HeldPlace& held : Patch(run, 0)) {
      force -= run->solver.ForceOn(held.at).z();
    }
    return force;
  };
  EXPECT_LT(pull(&cut), 0.5f * pull(&whole));
}

TEST_F(Accurate, DamageIsQuarantinedAndDoesNotSpread) {
  Run run(scene_);
  const ParticleRef at = run.particles.NodeRef(scene_.membrane.rows / 2, scene_.membrane.cols / 2);
  run.solver.SetVelocity(at, Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  std::uint32_t resets = 0;
  run.solver.BeginStep();
  resets += run.solver.Substep(kH, kIterations, {}, {}).resets;
  EXPECT_EQ(resets, 1u) << "One particle was damaged, and its neighbours do not notice.";
  run.particles.Set(at, Vec3f::Constant(std::numeric_limits<float>::infinity()));
  EXPECT_EQ(run.solver.BeginStep(), 3u);
  for (int i = 0; i < 100; ++i) {
    run.Step();
  }
  EXPECT_LT(LargestDisplacement(run), 0.001f);
  for (const float x : run.Positions()) {
    ASSERT_TRUE(std::isfinite(x));
  }
}

TEST_F(Accurate, ContactHoldsTheSheetUp) {
  Run run(scene_);
  const Index rows = scene_.membrane.rows, cols = scene_.membrane.cols;
  const Index particle = scene_.membrane.first + (rows / 2) * cols + cols / 2;
  const Vec3f rest = scene_.rest_position[particle];
  ContactRow row;
  row.count = 1;
  row.at[0] = run.particles.Ref(particle);
  row.weight[0] = 1;
  row.normal = Vec3f::UnitZ();
  row.offset = rest.z() + 0.002f;
  for (int i = 0; i < 60; ++i) {
    run.Step({}, {&row, 1});
  }
  EXPECT_GT(run.particles.At(row.at[0]).z(), rest.z() + 0.0015f);
  EXPECT_GT(row.force_N, 0.01f);
  row.offset = -1;
  run.Step({}, {&row, 1});
  EXPECT_EQ(row.force_N, 0.0f);
}

}  // namespace
}  // namespace fulcrum::physics
