// Tissue that graspers take, hold and lose.
#include "physics_node/grasp/grasp.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

constexpr std::uint32_t kRows = 25, kCols = 25;
constexpr float kH = 0.002f;
const Vec3f kMiddle(0.024f, 0.024f, 0.0f);

ToolPose Down(const Vec3f& tip, float jaw_rad) {
  return {tip, Quatf(Eigen::AngleAxisf(static_cast<float>(M_PI), Vec3f::UnitX())), jaw_rad};
}

class Grasps : public testing::Test {
 protected:
  scene::SceneData data_ = SheetScene(kRows, kCols, kH);
  SceneView scene_ = data_.View();
  ParticleStore particles_{scene_};
  TissueModel model_{scene_, &particles_};
  Grasp grasp_{scene_};

  void Close(const Vec3f& tip, float jaw_rad = 0.0f) {
    grasp_.Update(scene_.tools[0], Down(tip, 0.9f), model_, &particles_);
    grasp_.Update(scene_.tools[0], Down(tip, jaw_rad), model_, &particles_);
  }
  /// Folds the sheet along the middle column: two sheets 1 mm apart that stand up from the plane.
  void Fold() {
    for (Index r = 0; r < kRows; ++r) {
      for (Index c = 7; c <= 17; ++c) {
        const int out = std::abs(static_cast<int>(c) - 12);
        const Vec3f p(kMiddle.x() + (c < 12   ? -0.0005f
                                     : c > 12 ? 0.0005f
                                              : 0.0f),
                      static_cast<float>(r) * kH, kH * static_cast<float>(5 - out));
        particles_.Set(particles_.Ref(r * kCols + c), p);
      }
    }
  }
};

TEST_F(Grasps, AFoldIsHeldWithAllItsSheets) {
  Fold();
  Close(kMiddle + Vec3f(0, 0, 0.004f));
  ASSERT_TRUE(grasp_.holding());
  std::set<Index> columns;
  for (const HeldParticle& held : grasp_.held()) {
    columns.insert(held.particle % kCols);
  }
  // Columns of the ridge and both flanks.
  for (const Index c : {10u, 11u, 12u, 13u, 14u}) {
    EXPECT_TRUE(columns.contains(c)) << c;
  }
  const ToolPose moved = Down(kMiddle + Vec3f(0.001f, 0.002f, 0.01f), 0.0f);
  grasp_.Move(moved, &particles_);
  for (const HeldParticle& held : grasp_.held()) {
    EXPECT_LT((particles_.At(particles_.Ref(held.particle)) - moved.ToWorld(held.p_T)).norm(), 1e-7f);
  }
}

TEST_F(Grasps, WhatLiesBetweenOpenJawsIsTakenAsTheyClose) {
  // Just closed past the limit: the jaws still span 3 mm at their tips, and the tissue between them is held.
  Fold();
  Close(kMiddle + Vec3f(0, 0, 0.004f), 0.24f);
  const std::size_t at_limit = grasp_.held().size();
  EXPECT_GT(at_limit, 10u);
}

TEST_F(Grasps, TwoToolsNeverHoldTheSameTissue) {
  Close(kMiddle);
  Grasp other(scene_);
  const Vec3f beside = kMiddle + Vec3f(0.003f, 0, 0);
  other.Update(scene_.tools[0], Down(beside, 0.9f), model_, &particles_);
  other.Update(scene_.tools[0], Down(beside, 0.0f), model_, &particles_);
  ASSERT_TRUE(grasp_.holding());
  ASSERT_TRUE(other.holding());
  std::set<Index> mine;
  for (const HeldParticle& held : grasp_.held()) {
    mine.insert(held.particle);
  }
  for (const HeldParticle& held : other.held()) {
    EXPECT_FALSE(mine.contains(held.particle));
  }
  other.Release(model_, &particles_);
  for (const HeldParticle& held : grasp_.held()) {
    EXPECT_EQ(particles_.InverseMass(particles_.Ref(held.particle)), 0.0f);
  }
}

TEST_F(Grasps, TheGripGrowsAsTheJawsClose) {
  const PhysicsParams& params = scene_.physics;
  EXPECT_EQ(Grasp::GripForce(params, 0.0f), params.grip_force_N);
  EXPECT_EQ(Grasp::GripForce(params, -0.1f), params.grip_force_N);
  EXPECT_EQ(Grasp::GripForce(params, params.grasp_open_rad), 0.0f);
  EXPECT_EQ(Grasp::GripForce(params, 1.0f), 0.0f);
  float last = 1e9f;
  for (float jaw = 0; jaw < params.grasp_open_rad; jaw += 0.05f) {
    EXPECT_LT(Grasp::GripForce(params, jaw), last);
    last = Grasp::GripForce(params, jaw);
  }
}

TEST_F(Grasps, SlipsAboveTheGripOfItsJawAngleOnly) {
  for (const float jaw : {0.0f, 0.1f, 0.2f}) {
    Close(kMiddle, jaw);
    ASSERT_TRUE(grasp_.holding());
    const float grip = Grasp::GripForce(scene_.physics, jaw);
    const ToolPose pose = Down(kMiddle, jaw);
    const Vec3f before = grasp_.held().front().p_T;
    for (int i = 0; i < 100; ++i) {
      grasp_.Slip(Vec3f(0.99f * grip, 0, 0), scene_.physics.dt_s, scene_.tools[0], pose, model_, &particles_);
    }
    EXPECT_EQ(grasp_.held().front().p_T, before);
    for (int i = 0; i < 10; ++i) {  // Longer than a jolt.
      grasp_.Slip(Vec3f(1.2f * grip, 0, 0), scene_.physics.dt_s, scene_.tools[0], pose, model_, &particles_);
    }
    const Vec3f crept = grasp_.held().front().p_T - before;
    EXPECT_GT(crept.x(), 0.0f);  // Along the traction, which is x of the tool, too.
    EXPECT_LT(crept.norm(), 0.003f);
    for (int i = 0; i < 400; ++i) {
      grasp_.Slip(Vec3f(2.0f * grip, 0, 0), scene_.physics.dt_s, scene_.tools[0], pose, model_, &particles_);
    }
    EXPECT_FALSE(grasp_.holding());  // All tissue is out of the jaws.
    for (Index p = 0; p < particles_.particle_count(); ++p) {
      ASSERT_EQ(particles_.InverseMass(particles_.Ref(p)), scene_.inverse_mass[p]);
    }
    grasp_ = Grasp(scene_);
  }
}

/// One step of a second above the grip: 50 mm/s at twice the grip (assumed), of what is held fully. What is held less
/// creeps the faster.
TEST_F(Grasps, FirmlyHeldTissueSlipsLast) {
  Close(kMiddle);
  ASSERT_TRUE(grasp_.holding());
  struct Before {
    Vec3f p_T = Vec3f::Zero();
    float hold = 0;
  };
  std::map<Index, Before> before;
  float least = 2, most = 0;
  for (const HeldParticle& held : grasp_.held()) {
    const float hold = grasp_.HoldOf(held, scene_.tools[0]);
    before[held.particle] = {held.p_T, hold};
    least = std::min(least, hold);
    most = std::max(most, hold);
  }
  EXPECT_EQ(most, 1.0f);
  EXPECT_LT(least, 0.9f);
  EXPECT_GE(least, 0.3f);
  const float grip = scene_.physics.grip_force_N;
  const auto pull = [&](float force_N, float step_s) {
    grasp_.Slip(Vec3f(0, 0, force_N), step_s, scene_.tools[0], Down(kMiddle, 0), model_, &particles_);
  };
  for (int i = 0; i < 100; ++i) pull(0.99f * grip, 0.01f);
  pull(1.03f * grip, 1);
  // The traction is low-passed with 30 ms.
  const float excess = 0.99f + (1.03f - 0.99f) / 1.03f - 1, creep_m = 0.05f * excess;
  ASSERT_GT(grasp_.held().size(), 5u);
  for (const HeldParticle& held : grasp_.held()) {
    const Before& was = before.at(held.particle);
    EXPECT_NEAR((held.p_T - was.p_T).norm() * was.hold, creep_m, 0.02f * creep_m) << "hold " << was.hold;
  }
}

/// The tool is turned by 90 degrees about y: traction along x of W draws the tissue along z of the tool.
TEST_F(Grasps, TissueCreepsTheWayItIsDrawn) {
  Close(kMiddle);
  ASSERT_TRUE(grasp_.holding());
  const Vec3f before = grasp_.held().front().p_T;
  const ToolPose turned{kMiddle, Quatf(Eigen::AngleAxisf(static_cast<float>(M_PI / 2), Vec3f::UnitY())), 0};
  for (int i = 0; i < 10; ++i) {
    grasp_.Slip(Vec3f(1.2f * scene_.physics.grip_force_N, 0, 0), 0.01f, scene_.tools[0], turned, model_, &particles_);
  }
  const Vec3f crept = grasp_.held().front().p_T - before;
  EXPECT_GT(crept.norm(), 1e-5f);
  EXPECT_GT(crept.normalized().z(), 0.99f) << crept.transpose();
}

TEST_F(Grasps, NeverTakesOrKeepsWhatIsDead) {
  TopologyState cut;
  cut.rows = kRows;
  cut.cols = kCols;
  cut.dead_nodes.assign((kRows * kCols + 7) / 8, 0);
  cut.dead_edges.assign((3 * kRows * kCols + 7) / 8, 0);
  cut.shrink.assign(3 * kRows * kCols, 0);
  const Index dead = 12 * kCols + 12;
  SetBit(cut.dead_nodes, dead);
  ASSERT_GT(model_.Apply(cut, &particles_), 0);
  Close(kMiddle);
  ASSERT_TRUE(grasp_.holding());
  for (const HeldParticle& held : grasp_.held()) {
    EXPECT_NE(held.particle, dead);
  }
  const Index dies = grasp_.held().front().particle;
  SetBit(cut.dead_nodes, dies);
  ++cut.revision;
  ASSERT_GT(model_.Apply(cut, &particles_), 0);
  grasp_.DropDead(model_, &particles_);
  for (const HeldParticle& held : grasp_.held()) {
    EXPECT_NE(held.particle, dies);
  }
}

TEST(GraspLayers, OrganAndMembraneBetweenTheJawsAreHeldTogether) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const SceneView scene = data.View();
  ParticleStore particles(scene);
  const TissueModel model(scene, &particles);
  // A grasp along a vertex of the organ's top, with the tip well below it.
  Index top = kNoIndex;
  for (Index v = 0; v < scene.tube_vertex_count; ++v) {
    const bool middle = std::abs(scene.rest_position[v].y()) < 0.02f && scene.inverse_mass[v] > 0.0f;
    if (middle && (top == kNoIndex || scene.rest_position[v].z() > scene.rest_position[top].z())) {
      top = v;
    }
  }
  Grasp grasp(scene);
  const Vec3f tip = scene.rest_position[top] - Vec3f(0, 0, 0.004f);
  grasp.Update(scene.tools[0], Down(tip, 0.9f), model, &particles);
  grasp.Update(scene.tools[0], Down(tip, 0.0f), model, &particles);
  ASSERT_TRUE(grasp.holding());
  bool organ = false, membrane = false;
  for (const HeldParticle& held : grasp.held()) {
    (held.particle < scene.tube_vertex_count ? organ : membrane) = true;
  }
  EXPECT_TRUE(organ);
  EXPECT_TRUE(membrane);
}

}  // namespace
}  // namespace fulcrum::physics
