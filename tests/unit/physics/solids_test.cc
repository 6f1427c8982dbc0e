// Several solids in one scene: stiffness of their own, contact with each other, what joins them, sleep, determinism.
#include "services/base/core/solids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/simulation/script_player.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/compiler/compile.h"
#include "tests/support/several_solids.h"

namespace fulcrum::physics {
namespace {

const Vec3f kEarth(0, 0, -9.81f);
constexpr Index kPad = 1, kLump = 2, kStrand = 3;

class OnSeveralSolids : public testing::Test {
 protected:
  explicit OnSeveralSolids(const Vec3f& gravity = Vec3f::Zero()) : data_(SeveralSolids(gravity)) {}

  [[nodiscard]] Vec3f MeanOf(const TissueSimulation& simulation, Index solid) const {
    const Solid& s = scene_.solids[solid];
    Vec3f sum = Vec3f::Zero();
    for (Index v = s.first_vertex; v < s.first_vertex + s.vertex_count; ++v) sum += At(simulation, v);
    return sum / static_cast<float>(s.vertex_count);
  }
  /// Height of the lowest vertex.
  [[nodiscard]] float Bottom(const TissueSimulation& simulation, Index solid) const {
    const Solid& s = scene_.solids[solid];
    float low = 1;
    for (Index v = s.first_vertex; v < s.first_vertex + s.vertex_count; ++v) {
      low = std::min(low, At(simulation, v).z());
    }
    return low;
  }
  [[nodiscard]] static Vec3f At(const TissueSimulation& simulation, Index v) {
    return simulation.particles().At(simulation.particles().Ref(v));
  }

  scene::SceneData data_;
  SceneView scene_ = data_.View();
};

class UnderGravity : public OnSeveralSolids {
 protected:
  UnderGravity() : OnSeveralSolids(kEarth) {}
};

TEST_F(OnSeveralSolids, HaveTheModulusOfTheirOwn) {
  const ElasticModel model = BuildElasticModel(scene_);
  const double organ_Pa = scene_.physics.tube_youngs_modulus_Pa;
  for (const ElasticTet& tet : model.tets) {
    const auto solid = std::ranges::find_if(scene_.solids, [&](const Solid& s) {
      return tet.v[0] >= s.first_vertex && tet.v[0] < s.first_vertex + s.vertex_count;
    });
    ASSERT_NE(solid, scene_.solids.end());
    EXPECT_NEAR(tet.scale * organ_Pa, static_cast<double>(solid->youngs_modulus_Pa), 1);
  }
  EXPECT_GT(model.attachments.size(), 3u);
}

TEST_F(OnSeveralSolids, TheModulusOfOneScalesItsPartOfTheMatrixOnly) {
  scene::SceneData stiffer = data_;
  stiffer.solids[kPad].youngs_modulus_Pa *= 3;
  const ElasticModel one = BuildElasticModel(scene_), other = BuildElasticModel(stiffer.View());
  const auto of_pad = [&](Index v) {
    return v >= scene_.solids[kPad].first_vertex &&
           v < scene_.solids[kPad].first_vertex + scene_.solids[kPad].vertex_count;
  };
  ASSERT_EQ(one.patches.size(), other.patches.size());
  double volume = 0;
  for (std::size_t i = 0; i < one.patches.size(); ++i) {
    const double factor = of_pad(one.patches[i].vertex) ? 3 : 1;
    EXPECT_NEAR(other.patches[i].volume, factor * one.patches[i].volume, 1e-6 * other.patches[i].volume);
    if (of_pad(one.patches[i].vertex)) volume += one.patches[i].volume;
  }
  // Against the organ's modulus, to which the model's Lame parameters belong.
  const double scale =
      static_cast<double>(scene_.solids[kPad].youngs_modulus_Pa / scene_.physics.tube_youngs_modulus_Pa);
  EXPECT_NEAR(volume, scale * 0.04 * 0.04 * 0.015, 1e-9);
  for (std::size_t i = 0; i < one.shear_links.size(); ++i) {
    const double factor = of_pad(one.shear_links[i].a) ? 3 : 1;
    EXPECT_NEAR(other.shear_links[i].stiffness, factor * one.shear_links[i].stiffness,
                1e-6 * std::abs(other.shear_links[i].stiffness) + 1e-9);
  }
}

TEST_F(OnSeveralSolids, StayAtRestAndSleep) {
  TissueSimulation simulation(scene_);
  int steps = 0;
  while (!simulation.Step({}).asleep && steps < 200) ++steps;
  EXPECT_LT(steps, 100);
  EXPECT_LT(simulation.MaxDisplacement(), 1e-5f);
  EXPECT_EQ(simulation.quarantined(), 0u);
}

TEST_F(UnderGravity, ALooseOneFallsOntoAnotherAndLiesThere) {
  TissueSimulation simulation(scene_);
  const float pad = Bottom(simulation, kPad) + 0.015f;
  for (int i = 0; i < 300; ++i) simulation.Step({});
  // A lump of 8 g: it sinks in by the softness of the contact and of the pad.
  EXPECT_GT(Bottom(simulation, kLump), pad - 0.003f);
  EXPECT_LT(Bottom(simulation, kLump), pad + 0.001f);
  EXPECT_NEAR(MeanOf(simulation, kLump).x(), 0.14f, 0.002f);
  EXPECT_EQ(simulation.quarantined(), 0u);
  float most = 0;
  for (int i = 0; i < 50; ++i) most = std::max(most, simulation.Step({}).max_step_m);
  EXPECT_LT(most, 2e-4f) << "it still moves";
}

TEST_F(UnderGravity, WhatJoinsTwoHoldsTheLighterOne) {
  scene::SceneData loose = data_;
  loose.attachments.clear();
  const SceneView without = loose.View();
  TissueSimulation joined(scene_), apart(without);
  for (int i = 0; i < 200; ++i) {
    joined.Step({});
    apart.Step({});
  }
  const Index end = scene_.solids[kStrand].first_vertex;  // Beside the pad.
  const float fall = scene_.rest_position[end].z() - At(joined, end).z();
  EXPECT_LT(fall, 0.0015f);
  EXPECT_GT(scene_.rest_position[end].z() - At(apart, end).z(), 3 * fall + 0.001f);
}

TEST_F(OnSeveralSolids, PushOneAnotherAway) {
  TissueSimulation simulation(scene_);
  // A grasper presses the lump down onto the pad.
  std::array<ToolInput, kMaxTools> tools{};
  tools[0].present = true;
  tools[0].pose.q_WT = Quatf(0, 1, 0, 0);  // Its tip points down.
  const Vec3f before = MeanOf(simulation, kPad);
  for (int i = 0; i < 150; ++i) {
    tools[0].pose.p_WT = Vec3f(0.14f, 0, 0.05f - 0.0002f * static_cast<float>(std::min(i, 100)));
    tools[0].pose.jaw_rad = 0;
    simulation.Step(tools);
  }
  EXPECT_LT(MeanOf(simulation, kPad).z(), before.z() - 1e-5f) << "the pad was pressed through the lump";
  // Vertices of the lump's lower side lay a millimetre above vertices of the pad.
  float deepest = 0, pressed = 0;
  for (Index y = 0; y < 5; ++y) {
    for (Index x = 0; x < 5; ++x) {
      const Vec3f above = At(simulation, scene_.solids[kLump].first_vertex + 5 * y + x);
      const Index vertex = scene_.solids[kPad].first_vertex + (3 * 9 + y + 2) * 9 + x + 2;
      const Vec3f below = At(simulation, vertex);
      deepest = std::max(deepest, below.z() - above.z());
      pressed = std::max(pressed, scene_.rest_position[vertex].z() - below.z());
    }
  }
  EXPECT_GT(pressed, 0.001f);
  EXPECT_LT(deepest, 0.001f);
  EXPECT_EQ(simulation.quarantined(), 0u);
}

/// A pad on which a pressed lump has come to rest yields again when the lump is pressed further.
TEST_F(OnSeveralSolids, WakeWhenWhatLiesOnThemMovesAgain) {
  TissueSimulation simulation(scene_);
  std::array<ToolInput, kMaxTools> tools{};
  tools[0].present = true;
  tools[0].pose.q_WT = Quatf(0, 1, 0, 0);
  tools[0].pose.jaw_rad = 0;
  const auto press = [&](float from_m, float to_m, int steps) {
    for (int i = 1; i <= steps; ++i) {
      const float part = std::min(1.0f, 2 * static_cast<float>(i) / static_cast<float>(steps));
      tools[0].pose.p_WT = Vec3f(0.14f, 0, 0.05f - from_m - part * (to_m - from_m));
      simulation.Step(tools);
    }
    return MeanOf(simulation, kPad).z();
  };
  const float at_first = press(0, 0.019f, 150);
  const float at_rest = press(0.019f, 0.019f, 300);
  EXPECT_NEAR(at_rest, at_first, 1e-4f);
  const float again = press(0.019f, 0.023f, 100);
  EXPECT_LT(again, at_rest - 2e-5f);
}

/// Their coarse nodes are off, those of the membrane and the organ are not.
TEST_F(OnSeveralSolids, ThatNothingTouchesSleepWhileTheMembraneMovesAsWithoutThem) {
  scene::SceneSettings settings = scene::Small();
  settings.physics.gravity = Vec3f::Zero();
  settings.physics.mode = PhysicsMode::kAccurate;
  const scene::SceneData alone_data = scene::AssembleScene(settings, scene::ProceduralAnatomy(settings));
  const SceneView alone_scene = alone_data.View();
  TissueSimulation simulation(scene_), alone(alone_scene);
  // A hook presses the membrane down and moves along it.
  std::array<ToolInput, kMaxTools> tools{};
  tools[1].present = true;
  tools[1].pose.q_WT = Quatf(0, 1, 0, 0);
  const Vec3f middle =
      alone_scene.rest_position[alone_scene.membrane.first + alone_scene.membrane.rows / 2 * alone_scene.membrane.cols +
                                alone_scene.membrane.cols / 2];
  const auto others = [&] {
    std::vector<Vec3f> places;
    for (Index v = scene_.solids[kPad].first_vertex; v < scene_.tube_vertex_count; ++v) {
      places.push_back(At(simulation, v));
    }
    return places;
  };
  std::vector<Vec3f> before;
  for (int i = 0; i < 120; ++i) {
    tools[1].pose.p_WT = middle + Vec3f(0, 0.0001f * static_cast<float>(i), 0.004f - 0.0001f * static_cast<float>(i));
    simulation.Step(tools);
    alone.Step(tools);
    if (i == 70) before = others();
  }
  EXPECT_GT(alone.MaxDisplacement(), 0.002f);
  EXPECT_EQ(others(), before);
  const float of_first = static_cast<float>(scene_.solids[0].vertex_count + scene_.membrane.node_count()) /
                         static_cast<float>(scene_.tube_vertex_count + scene_.membrane.node_count());
  EXPECT_LE(simulation.awake_part(), of_first + 1e-5f);
  EXPECT_GT(simulation.awake_part(), 0.1f);
  for (Index node = 0; node < alone_scene.membrane.rows * alone_scene.membrane.cols; ++node) {
    const Vec3f there = At(simulation, scene_.membrane.first + node);
    const Vec3f here = At(alone, alone_scene.membrane.first + node);
    ASSERT_LT((there - here).norm(), 1e-4f) << node;
  }
}

/// A restart does not wake what was at rest; what moved goes on.
TEST_F(OnSeveralSolids, ThatWereAtRestSleepAfterARestart) {
  TissueSimulation simulation(scene_), restarted(scene_), woken(scene_);
  std::array<ToolInput, kMaxTools> tools{};
  tools[1].present = true;
  tools[1].pose.q_WT = Quatf(0, 1, 0, 0);
  const Vec3f middle = scene_.rest_position[scene_.membrane.first + scene_.membrane.node_count() / 2];
  for (int i = 0; i < 100; ++i) {
    tools[1].pose.p_WT = middle + Vec3f(0, 0, 0.004f - 0.0001f * static_cast<float>(i));
    simulation.Step(tools);
  }
  std::vector<float> xyz(3 * scene_.rest_position.size()), previous(xyz.size());
  simulation.particles().CopyPositions(xyz);
  simulation.particles().CopyPrevious(previous);
  const SimulationMemory memory = simulation.Save();
  ASSERT_TRUE(restarted.Restore(xyz, previous, memory));
  restarted.LetStillBodiesSleep();
  ASSERT_TRUE(woken.Restore(xyz, previous, memory));
  restarted.Step(tools);
  woken.Step(tools);
  const float of_first = static_cast<float>(scene_.solids[0].vertex_count + scene_.membrane.node_count()) /
                         static_cast<float>(scene_.rest_position.size());
  EXPECT_LE(restarted.awake_part(), of_first + 1e-5f);
  EXPECT_GT(restarted.awake_part(), 0.1f);
  EXPECT_EQ(woken.awake_part(), 1.0f);
  for (Index v = scene_.solids[kPad].first_vertex; v < scene_.tube_vertex_count; ++v) {
    ASSERT_EQ(At(restarted, v), At(simulation, v));
  }
}

/// A hook presses the pad beside the lump, whose vertices lie on the same triangles, and then keeps still.
TEST(TwoSolidsUnderATool, HaveASteadyForce) {
  scene::SceneSettings settings = scene::Small();
  settings.physics.mode = PhysicsMode::kAccurate;
  settings.physics.gravity = kEarth;
  scene::Anatomy anatomy = scene::ProceduralAnatomy(settings);
  const Vec3d corner(0.12, -0.02, 0);
  scene::SolidBody pad = Box("pad", corner, {0.04, 0.04, 0.015}, {8, 8, 3}, 2e4);
  Fix(&pad, [](const Vec3d& p) { return p.z() < 1e-6; });
  anatomy.solids.push_back(std::move(pad));
  anatomy.solids.push_back(Box("lump", corner + Vec3d(0.0123, 0.0117, 0.016), {0.02, 0.02, 0.02}, {4, 4, 4}, 4e4));
  const scene::SceneData data = scene::AssembleScene(settings, anatomy);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  std::array<ToolInput, kMaxTools> tools{};
  for (int i = 0; i < 200; ++i) simulation.Step(tools);
  tools[1].present = true;
  tools[1].pose.q_WT = Quatf(0, 1, 0, 0);  // Its tip points down.
  constexpr int kPress = 60, kSteps = 120;
  float last = 0;
  for (int i = 0; i < kSteps; ++i) {
    tools[1].pose.p_WT = Vec3f(0.1281f, -0.004f, 0.020f - 0.00015f * static_cast<float>(std::min(i, kPress)));
    simulation.Step(tools);
    (void)simulation.Contacts(1);
    const float now = simulation.solver_force(1).norm();
    if (i > kPress + 10) {
      EXPECT_GT(now, 0.3f);
      EXPECT_NEAR(now, last, 0.2f * last) << i;
    }
    last = now;
  }
}

TEST_F(UnderGravity, AreTheSameOnAnyNumberOfThreads) {
  TissueSimulation one(scene_, 1), three(scene_, 3);
  three.LetThreadsHelp(true);
  for (int i = 0; i < 80; ++i) {
    one.Step({});
    three.Step({});
    ASSERT_EQ(one.StateHash(), three.StateHash()) << "step " << i;
  }
}

TEST_F(UnderGravity, ALooseOneIsCaughtFromFarAbove) {
  const Solid& lump = scene_.solids[kLump];
  for (Index v = lump.first_vertex; v < lump.first_vertex + lump.vertex_count; ++v) data_.rest_position[v].z() += 0.1f;
  TissueSimulation simulation(scene_);
  for (int i = 0; i < 200; ++i) simulation.Step({});
  EXPECT_GT(Bottom(simulation, kLump), 0.010f);
  EXPECT_LT(Bottom(simulation, kLump), 0.020f);
}

TEST(ASolidOfOneTetrahedron, HasALattice) {
  scene::SceneSettings settings = scene::Small();
  settings.physics.mode = PhysicsMode::kAccurate;
  scene::Anatomy anatomy = scene::ProceduralAnatomy(settings);
  for (int i = 1; i < static_cast<int>(kMaxSolids); ++i) {
    scene::SolidBody one;
    one.name = "one";
    const Vec3d at(0.1 + 0.02 * i, 0, 0);
    one.vertices = {at, at + Vec3d(0.01, 0, 0), at + Vec3d(0, 0.01, 0), at + Vec3d(0, 0, 0.01)};
    one.tets = {{0, 1, 2, 3}};
    one.fixed = {true, true, true, false};
    one.surface_vertices = one.vertices;
    one.surface_triangles = scene::BoundaryOf(one.tets);
    anatomy.solids.push_back(one);
  }
  const scene::SceneData data = scene::AssembleScene(settings, anatomy);
  TissueSimulation simulation(data.View());
  for (int i = 0; i < 20; ++i) simulation.Step({});
  EXPECT_LT(simulation.MaxDisplacement(), 1e-5f);
}

/// The shipped scene: the fundus is held and follows, nothing is reset.
TEST(TheGallbladder, FollowsTheGrasper) {
  const scene::SceneData data =
      scene::CompileScene(std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes/gallbladder.yaml", {}, {}).data;
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  for (int i = 0; i < 600; ++i) simulation.Step(ScriptedTools(scene, 0.01 * i));
  EXPECT_TRUE(simulation.grasp(0).holding());
  EXPECT_GT(simulation.MaxDisplacement(), 0.008f);
  EXPECT_LT(simulation.MaxDisplacement(), 0.025f);
  EXPECT_EQ(simulation.quarantined(), 0u);
}

}  // namespace
}  // namespace fulcrum::physics
