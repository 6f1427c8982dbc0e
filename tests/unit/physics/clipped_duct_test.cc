// A clip applier on a solid body, a duct say: the clip is placed on the body's vertices, holds them together when the
// jaws have let go, and moves with them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "physics_node/simulation/script_player.h"
#include "tests/support/flat_sheets.h"
#include "tests/support/several_solids.h"

namespace fulcrum::physics {
namespace {

constexpr double kDuctFree_s = 1.3, kDuctGripped_s = 2, kDuctPulled_s = 3.5;
const Vec3f kDuctPull(0, 0.002f, 0.006f);

/// A duct of 2 x 3 mm along y, between the open jaws without touching them, one end held. The applier (tool 0) comes
/// along -z at y = 0; the grasper (tool 1) takes the other end and moves by kDuctPull.
/// @param cells of the duct in x, y and z.
/// @param shift_m along y of the duct, whose lines of vertices are 40 mm / cells[1] apart.
scene::SceneData Duct(const std::array<int, 3>& cells = {2, 40, 3}, double shift_m = 0) {
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.name = "duct";
  settings.tools = {};
  const Vec3f tip(0, 0, -0.006f), away(0, 0, 0.06f), grip(0, 0.016f, 0);
  settings.tools[0] = scene::DefaultTool(ToolKind::kClipApplier, Vec3f(0, 0, 0.2f));
  settings.tools[0].tip_length_m = 0.008f;
  settings.tools[0].tip_radius_m = 0.001f;
  settings.tools[1] = scene::DefaultTool(ToolKind::kGrasper, grip + Vec3f(0, 0, 0.2f));
  const auto key = [&](double time_s, int tool, const Vec3f& place, double jaw_rad) {
    settings.script.push_back({.time_s = time_s, .tool = tool, .world_m = place, .jaw_rad = jaw_rad});
  };
  key(0, 0, away, 1.2);
  key(0.3, 0, tip, 1.2);
  key(0.7, 0, tip, 0);
  key(0.9, 0, tip, 0);
  key(1.1, 0, tip, 1.2);
  key(kDuctFree_s, 0, away, 1.2);
  key(0, 1, grip + away, 1.2);
  key(kDuctFree_s, 1, grip + away, 1.2);
  key(1.6, 1, grip + tip, 1.2);
  key(1.9, 1, grip + tip, 0);
  key(kDuctGripped_s, 1, grip + tip, 0);
  key(kDuctPulled_s, 1, grip + tip + kDuctPull, 0);
  settings.script_duration_s = kDuctPulled_s + 1;
  scene::Anatomy anatomy;
  anatomy.solids.push_back(Box("duct", {-0.001, -0.02 + shift_m, -0.005}, {0.002, 0.04, 0.003}, cells, 1e5));
  Fix(&anatomy.solids.back(), [&](const Vec3d& p) { return p.y() < -0.0199 + shift_m; });
  return scene::AssembleScene(settings, anatomy);
}

TEST(ClippedDuct, IsHeldByAClipOnItsVertices) {
  const scene::SceneData data = Duct();
  const SceneView scene = data.View();
  TissueSimulation simulation(scene, 1);
  int steps = 0;
  const auto run_to = [&](double time_s) {
    for (; 0.01 * steps < time_s; ++steps) simulation.Step(ScriptedTools(scene, 0.01 * steps));
  };
  const auto at = [&](Index particle) { return simulation.particles().At(simulation.particles().Ref(particle)); };
  const auto pose = [&] {
    ClipState state;
    simulation.clips().Fill(&state);
    const auto& anchors = state.clips[0].anchors;
    return PoseOf(state.clips[0], at(anchors[0]), at(anchors[1]), at(anchors[2]));
  };
  run_to(kDuctFree_s);
  ASSERT_EQ(simulation.clips().count(), 1u);
  EXPECT_EQ(simulation.clips().refused(), 0u);
  EXPECT_EQ(simulation.held_particles(), 0u);
  const AppliedClip clip = simulation.clips().Save().clips[0];
  EXPECT_GT(clip.tissue.size(), 8u);
  for (const Index anchor : clip.placed.anchors) EXPECT_LT(anchor, scene.tube_vertex_count);
  const auto before = pose();
  ASSERT_TRUE(before);
  EXPECT_LT(before->p_WC.head<2>().norm(), 0.001f) << "where the jaws were";
  run_to(kDuctPulled_s + 0.5);
  ASSERT_EQ(simulation.clips().count(), 1u);
  const auto after = pose();
  ASSERT_TRUE(after);
  EXPECT_GT((after->p_WC - before->p_WC).norm(), 0.0005f) << "it moves with the tissue";
  const auto count = static_cast<Eigen::Index>(clip.tissue.size());
  Eigen::Matrix3Xd rest(3, count), now(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    rest.col(i) = clip.tissue[static_cast<std::size_t>(i)].p_C.cast<double>();
    now.col(i) = at(clip.tissue[static_cast<std::size_t>(i)].particle).cast<double>();
  }
  const Eigen::Matrix4d rigid = Eigen::umeyama(rest, now, false);
  const Eigen::Matrix3Xd off = now - ((rigid.topLeftCorner<3, 3>() * rest).colwise() + rigid.topRightCorner<3, 1>());
  EXPECT_LT(off.colwise().norm().maxCoeff(), 0.0005) << "in its arrangement";
  // The pose of the topic is that of the held tissue.
  const Vec3d middle = rigid.topRightCorner<3, 1>();
  EXPECT_LT((after->p_WC.cast<double>() - middle).norm(), 0.0005);
}

TEST(ClippedDuct, TakesAClipBetweenItsVerticesToo) {
  for (const double shift_m : {0.0, 0.001, 0.002, 0.003}) {
    const scene::SceneData data = Duct({1, 10, 1}, shift_m);
    const SceneView scene = data.View();
    TissueSimulation simulation(scene, 1);
    for (int step = 0; 0.01 * step < kDuctFree_s; ++step) simulation.Step(ScriptedTools(scene, 0.01 * step));
    ASSERT_EQ(simulation.clips().count(), 1u) << shift_m;
    const ClipMemory memory = simulation.clips().Save();
    for (const ClippedParticle& clipped : memory.clips[0].tissue) {
      EXPECT_LT(std::abs(scene.rest_position[clipped.particle].y()), 0.0041f) << "the next vertices to both sides";
    }
  }
}

}  // namespace
}  // namespace fulcrum::physics
