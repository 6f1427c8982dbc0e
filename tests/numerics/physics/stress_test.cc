// Misuse: motions that no operator intends must leave the state finite, bounded and recoverable.
#include <gtest/gtest.h>

#include <random>

#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::physics {
namespace {

class Stress : public testing::TestWithParam<unsigned> {
 protected:
  scene::SceneData data_ = scene::BuildProcedural(scene::Small());
  SceneView scene_ = data_.View();
  TissueSimulation simulation_{scene_};

  void ExpectBounded(float limit) {
    const float displacement = simulation_.MaxDisplacement();
    ASSERT_TRUE(std::isfinite(displacement));
    ASSERT_LT(displacement, limit);
  }
  /// Inverted tetrahedra of the organ at the end.
  [[nodiscard]] int Inverted() const {
    int inverted = 0;
    for (const Tetrahedron& t : scene_.tets) {
      const auto x = [&](int i) { return simulation_.particles().At({4 * t[static_cast<std::size_t>(i)], 1}); };
      inverted += (x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) <= 0.0f;
    }
    return inverted;
  }
};

TEST_P(Stress, WildToolsAndWildCuts) {
  std::mt19937 random(GetParam());
  std::uniform_real_distribution<float> unit(0, 1);
  TopologyState topology = WholeTopology(scene_);
  std::array<ToolInput, kMaxTools> tools = ScriptedTools(scene_, 0.0);
  std::array<Vec3f, kMaxTools> aim{Vec3f::Zero(), Vec3f::Zero()};
  for (int i = 0; i < 1200; ++i) {
    for (std::size_t t = 0; t < kMaxTools; ++t) {
      if (i % 40 == 0) {
        aim[t] = Vec3f(0.06f * (unit(random) - 0.5f), 0.09f * (unit(random) - 0.5f), 0.05f * unit(random) - 0.015f);
      }
      const Vec3f tip = tools[t].pose.p_WT + 0.1f * (aim[t] - tools[t].pose.p_WT);
      const float jaw = i % 60 < 30 ? 0.9f : 0.0f;
      tools[t].pose = PoseAtTip(scene_.tools[t], tip, jaw);
      tools[t].present = unit(random) > 0.002f || tools[t].present == false;
    }
    if (i % 25 == 0) {
      SetBit(topology.dead_edges, random() % (3 * scene_.membrane.node_count()));
      SetBit(topology.dead_nodes, random() % scene_.membrane.node_count());
      topology.shrink[random() % topology.shrink.size()] = static_cast<std::uint8_t>(random());
      ++topology.revision;
      ASSERT_GE(simulation_.ApplyTopology(topology), 0);
    }
    simulation_.Step(tools);
    for (std::uint32_t t = 0; t < kMaxTools; ++t) {
      const DeviceContacts device = simulation_.Contacts(t);
      for (std::uint32_t c = 0; c < device.count; ++c) {
        ASSERT_TRUE(device.contacts[c].f_ref.allFinite());
        ASSERT_LT(device.contacts[c].f_ref.norm(), 20.0f);
      }
    }
    if (i % 50 == 0) {
      ExpectBounded(0.15f);
    }
  }
  // Without tools, connected tissue returns to rest.
  for (int i = 0; i < 600; ++i) {
    simulation_.Step({});
  }
  ExpectBounded(0.08f);
  EXPECT_EQ(Inverted(), 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Stress, testing::Values(1u, 2u, 3u));

TEST_F(Stress, ThreeTimesTheLengthAndBack) {
  // The middle of the membrane is pulled far out and released.
  const Index first = scene_.membrane.first;
  ParticleStore& particles = simulation_.particles();
  for (Index r = 34; r < 40; ++r) {
    for (Index c = 10; c < 15; ++c) {
      const ParticleRef at = particles.Ref(first + r * 25 + c);
      particles.Set(at, particles.At(at) + Vec3f(0, 0, 0.02f));
      particles.SetPrevious(at, particles.At(at));
    }
  }
  for (int i = 0; i < 600; ++i) {
    simulation_.Step({});
  }
  ExpectBounded(0.003f);
  EXPECT_EQ(Inverted(), 0);
}

TEST_F(Stress, ScrambledOrganRecovers) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> offset(-0.004f, 0.004f);
  ParticleStore& particles = simulation_.particles();
  for (Index v = 0; v < scene_.tube_vertex_count; ++v) {
    const ParticleRef at{4 * v, 1};
    if (particles.InverseMass(at) > 0.0f) {
      particles.Set(at, particles.At(at) + Vec3f(offset(random), offset(random), offset(random)));
      particles.SetPrevious(at, particles.At(at));
    }
  }
  for (int i = 0; i < 1500; ++i) {
    simulation_.Step({});
  }
  ExpectBounded(0.02f);
}

TEST(Convergence, MoreIterationsComeCloserToTheConvergedShape) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const auto hold = [&](std::uint32_t iterations) {
    SceneView scene = data.View();
    scene.physics.mode = PhysicsMode::kPaper;
    scene.physics.iterations = iterations;
    TissueSimulation simulation(scene);
    // A patch is held 6 mm up: the same particles at the same places for every run.
    const Index first = scene.membrane.first;
    ParticleStore& particles = simulation.particles();
    for (int i = 0; i < 150; ++i) {
      const float up = 0.006f * std::min(1.0f, 0.02f * static_cast<float>(i));
      for (Index r = 35; r < 38; ++r) {
        for (Index c = 11; c < 14; ++c) {
          const ParticleRef at = particles.Ref(first + r * 25 + c);
          particles.SetInverseMass(at, 0.0f);
          particles.Set(at, scene.rest_position[first + r * 25 + c] + Vec3f(0, 0, up));
        }
      }
      simulation.Step({});
    }
    std::vector<float> xyz(3 * std::size_t{particles.particle_count()});
    particles.CopyPositions(xyz);
    return xyz;
  };
  const std::vector<float> converged = hold(200);
  const auto error = [&](const std::vector<float>& xyz) {
    double sum = 0;
    for (std::size_t i = 0; i < xyz.size(); ++i) {
      sum += std::pow(xyz[i] - converged[i], 2);
    }
    return std::sqrt(sum);
  };
  const double e3 = error(hold(3)), e10 = error(hold(10)), e40 = error(hold(40));
  EXPECT_GT(e3, e10);
  EXPECT_GT(e10, e40);
}

}  // namespace
}  // namespace fulcrum::physics
