// The accurate solver: equal bits on every instruction set, rest, pull and return, cuts, damaged input.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <vector>

#include "physics_node/implicit/implicit_solver.h"
#include "physics_node/implicit/workers.h"
#include "services/scene/builder/build.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::physics {
namespace {

using implicit::HeldPlace;
using implicit::ImplicitSolver;
using implicit::SubstepReport;

constexpr float kH = 0.005f;
constexpr int kIterations = 2;

class Accurate : public testing::Test {
 protected:
  Accurate() : data_(scene::BuildProcedural(scene::Small())), scene_(data_.View()) {}

  struct Run {
    explicit Run(const SceneView& scene, const implicit::Kernels& kernels = implicit::KernelsFor(), int threads = 1)
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
    ImplicitSolver solver;
  };

  /// A few nodes in the middle of the membrane, held `up` metres above their rest positions.
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
  TopologyState FirstTopology() const {
    TopologyState topology = WholeTopology(scene_);
    topology.revision = 1;
    return topology;
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

TEST_F(Accurate, SameBitsOnEveryInstructionSetAndAnyNumberOfThreads) {
  for (const MembraneModel model : {MembraneModel::kContinuum, MembraneModel::kSprings}) {
    scene_.physics.membrane_model = model;
    const auto run = [&](const implicit::Kernels& kernels, int threads, bool cut) {
      Run result(scene_, kernels, threads);
      if (cut) {
        TopologyState topology = FirstTopology();
        for (Index row = 20; row < 40; ++row) {
          SetBit(topology.dead_edges, 3 * (row * scene_.membrane.cols + scene_.membrane.cols / 2 + 3));
        }
        (void)result.tissue.Apply(topology, &result.particles);
        result.solver.UpdateTopology(result.tissue);
      }
      for (int i = 0; i < 20; ++i) {
        result.Step(Patch(&result, 0.0006f * static_cast<float>(i)));
      }
      return result.Positions();
    };
    for (const bool cut : {false, true}) {
      const std::vector<float> first = run(implicit::KernelsFor(), 1, cut);
      for (const InstructionSet set : kInstructionSets) {
        if (Has(set)) {
          EXPECT_EQ(run(implicit::KernelsFor(set), 1, cut), first) << implicit::KernelsFor(set).name;
        }
      }
      for (const int threads : {2, 3}) {
        EXPECT_EQ(run(implicit::KernelsFor(), threads, cut), first) << threads << " threads";
      }
    }
  }
}

TEST(Workers, DoEachTaskOnce) {
  implicit::Workers workers(3);
  std::vector<std::atomic<int>> done(200);
  for (int phase = 0; phase < 2000; ++phase) {
    const int tasks = phase % 200;
    workers.Run(tasks, tasks / 3, [&](int task, int worker) {
      EXPECT_LT(worker, 3);
      ++done[static_cast<std::size_t>(task)];
    });
  }
  for (int task = 0; task < 200; ++task) {
    EXPECT_EQ(done[static_cast<std::size_t>(task)], 10 * (199 - task));
  }
}

TEST_F(Accurate, SleepsWhereNothingMovesAndWakesWhereSomethingDoes) {
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  Run run(scene);
  for (int i = 0; i < 60; ++i) {
    run.Step();
  }
  EXPECT_TRUE(run.solver.regions().none_computed()) << "Nothing has ever moved.";

  // A node near one end is lifted and released: near regions wake, far regions do not.
  const Index particle = scene.membrane.first + 3 * scene.membrane.cols + scene.membrane.cols / 2;
  const ParticleRef at = run.particles.Ref(particle);
  const float w = run.particles.InverseMass(at);
  run.particles.SetInverseMass(at, 0);
  for (int i = 1; i <= 10; ++i) {
    const HeldPlace held{at, scene.rest_position[particle] + Vec3f(0, 0, 2e-6f * static_cast<float>(i))};
    run.Step({&held, 1});
  }
  const int far = run.solver.regions().partition().Of(run.particles.NodeRef(scene.membrane.rows - 1, 0));
  EXPECT_TRUE(run.solver.regions().computed(run.solver.regions().partition().Of(at)));
  EXPECT_FALSE(run.solver.regions().all_computed());
  EXPECT_FALSE(run.solver.regions().computed(far));
  run.particles.SetInverseMass(at, w);
  run.Step();
  EXPECT_GT(run.solver.Velocity(at).norm(), 1e-4f) << "Released, it moves.";
  for (int i = 0; i < 300 && !run.solver.regions().none_computed(); ++i) {
    run.Step();
  }
  EXPECT_TRUE(run.solver.regions().none_computed());
  EXPECT_LT((run.particles.At(at) - scene.rest_position[particle]).norm(), 1e-5f);
}

TEST_F(Accurate, ContactAndCutsWake) {
  Run run(scene_);
  for (int i = 0; i < 60; ++i) {
    run.Step();
  }
  ASSERT_TRUE(run.solver.regions().none_computed());
  const Index row_index = scene_.membrane.rows / 2, col = scene_.membrane.cols / 2;
  std::vector<ContactRow> contacts;
  for (Index r = row_index - 1; r <= row_index + 1; ++r) {
    for (Index c = col - 1; c <= col + 1; ++c) {
      ContactRow row;
      row.count = 1;
      row.at[0] = run.particles.NodeRef(r, c);
      row.weight[0] = 1;
      row.offset = run.particles.At(row.at[0]).z() - 0.001f;
      contacts.push_back(row);
    }
  }
  const int there = run.solver.regions().partition().Of(run.particles.NodeRef(row_index, col));
  run.Step({}, contacts);
  EXPECT_TRUE(run.solver.regions().none_computed()) << "The contacts are near but do not touch.";
  for (ContactRow& row : contacts) {
    row.offset += 0.0015f;
  }
  run.Step({}, contacts);
  EXPECT_TRUE(run.solver.regions().computed(there));
  for (int i = 0; i < 600; ++i) {
    run.Step({}, contacts);
  }
  ASSERT_TRUE(run.solver.regions().none_computed()) << "It rests on a support that does not move.";
  run.Step();
  EXPECT_TRUE(run.solver.regions().computed(there)) << "The support was removed.";
  for (int i = 0; i < 300; ++i) {
    run.Step();
  }
  ASSERT_TRUE(run.solver.regions().none_computed());

  TopologyState topology = FirstTopology();
  SetBit(topology.dead_edges, 3 * (row_index * scene_.membrane.cols + col));
  ASSERT_GT(run.tissue.Apply(topology, &run.particles), 0);
  run.solver.UpdateTopology(run.tissue);
  run.Step();
  EXPECT_TRUE(run.solver.regions().computed(there));
  for (int i = 0; i < 300; ++i) {
    run.Step();
  }
  ASSERT_TRUE(run.solver.regions().none_computed());
  // The first row of a region: one triangle of the edge belongs to the row above, which is in another one.
  Index first_row = row_index;
  const auto region_of = [&](Index row) {
    return run.solver.regions().partition().Of(run.particles.NodeRef(row, col));
  };
  while (region_of(first_row - 1) == region_of(row_index)) {
    --first_row;
  }
  topology.revision = 2;
  SetBit(topology.dead_edges, 3 * (first_row * scene_.membrane.cols + col));
  ASSERT_GT(run.tissue.Apply(topology, &run.particles), 0);
  run.solver.UpdateTopology(run.tissue);
  run.Step();
  EXPECT_TRUE(run.solver.regions().computed(region_of(first_row - 1)));
}

TEST_F(Accurate, AnswersQuestionsAsItThenBehaves) {
  Run run(scene_);
  constexpr float kStep = 0.0002f;
  const auto force = [&] {
    Vec3f sum = Vec3f::Zero();
    for (const HeldPlace& held : Patch(&run, 0)) {
      sum += run.solver.ForceOn(held.at);
    }
    return sum;
  };
  for (int i = 0; i < 30; ++i) {
    run.Step(Patch(&run, 0));
  }
  std::vector<ParticleRef> at;
  for (const HeldPlace& held : Patch(&run, 0)) {
    at.push_back(held.at);
  }
  const Vec3f before = force();
  const std::vector<float> places = run.Positions();
  const auto stiffness = [&](float horizon_s, std::size_t memory, int questions) {
    float answer = 0;
    for (int i = 0; i < questions; ++i) {
      EXPECT_TRUE(run.solver.Stiffness({at, Vec3f::UnitZ(), horizon_s, memory}, &answer));
    }
    return answer;
  };
  const float at_rest = stiffness(0, 0, 10), in_a_frame = stiffness(0.01f, 1, 3);
  EXPECT_EQ(run.Positions(), places);
  EXPECT_EQ(force(), before) << "The query does not change the state.";
  EXPECT_GT(in_a_frame, at_rest);
  for (int i = 0; i < 300; ++i) {
    run.Step(Patch(&run, kStep));
  }
  const float measured = (before - force()).z() / kStep;
  EXPECT_NEAR(at_rest, measured, 0.05f * measured);

  // The same patch, released before.
  Release(&run);
  for (int i = 0; i < 20; ++i) {
    run.Step();
  }
  EXPECT_NEAR(stiffness(0, 2, 10), measured, 0.1f * measured);
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
  EXPECT_LT(force.z(), -0.05f) << "The tissue pulls the held patch down.";
  Release(&run);
  for (int i = 0; i < 200; ++i) {
    run.Step();
  }
  EXPECT_LT(LargestDisplacement(run), 0.0004f);
}

TEST_F(Accurate, CutEdgesCarryNothing) {
  Run whole(scene_), cut(scene_);
  TopologyState topology = FirstTopology();
  // Cuts around the held patch.
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
  cut.solver.UpdateTopology(cut.tissue);
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
  EXPECT_EQ(resets, 1u) << "One particle was damaged, and its neighbours are not affected.";
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
