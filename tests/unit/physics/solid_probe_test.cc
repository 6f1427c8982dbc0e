// The hook on the surface of a solid: footprint in its chart, continuous while it slides; the charts of a scene.
#include "physics_node/contact_model/solid_probe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "physics_node/simulation/tissue_simulation.h"
#include "services/base/core/hash.h"
#include "services/transport/bus/gate.h"
#include "tests/support/several_solids.h"

namespace fulcrum::physics {
namespace {

/// The corner of the pad of SeveralSolids; its upper face, 40 mm wide and free of the lump at its rims, is 15 mm above.
const Vec3f kCorner(0.12f, -0.02f, 0);

class OnPad : public testing::Test {
 protected:
  /// Steps the hook to a place of its heel, foot along +x, shaft downward.
  CauteryContact To(const Vec3f& heel) {
    std::array<ToolInput, kMaxTools> tools{};
    tools[1].present = true;
    tools[1].pose.p_WT = heel;
    tools[1].pose.q_WT = Quatf(0, 1, 0, 0);  // z down, x stays.
    simulation_.Step(tools);
    CauteryContact contact = simulation_.Cautery(1);
    contact.stamp.stamp_ns = 1;
    EXPECT_TRUE(bus::PassesGate(contact));
    return contact;
  }

  scene::SceneData data_ = SeveralSolids();
  SceneView scene_ = data_.View();
  TissueSimulation simulation_{scene_};
  SolidCharts charts_ = MakeSolidCharts(scene_);
};

TEST_F(OnPad, TheFootprintLiesWhereTheMetalIs) {
  const float radius = scene_.tools[1].tip_radius_m;
  const Vec3f above = kCorner + Vec3f(0.003f, 0.005f, 0.02f);
  EXPECT_FALSE(To(above).on_solid);
  CauteryContact contact;
  for (int i = 0; i <= 60; ++i) contact = To(above - Vec3f(0, 0, 1e-4f * static_cast<float>(i)));
  ASSERT_TRUE(contact.on_solid);
  EXPECT_FALSE(contact.touching);
  ASSERT_NE(contact.triangle, kNoIndex);
  const Solid& pad = scene_.solids[1];
  const Index vertex = scene_.tube_surface[contact.triangle][0];
  EXPECT_TRUE(vertex >= pad.first_vertex && vertex < pad.first_vertex + pad.vertex_count);
  // The middle of the contact lies beneath the foot.
  const SolidChart& chart = charts_.charts[charts_.of_triangle[contact.triangle]];
  const float foot = scene_.tools[1].tip_length_m;
  const Vec2f heel = chart.Material(Vec3f(above.x(), above.y(), kCorner.z() + 0.015f));
  const Vec2f end = chart.Material(Vec3f(above.x() + foot, above.y(), kCorner.z() + 0.015f));
  const Vec2f along = (end - heel).normalized(), from_heel = contact.material - heel;
  EXPECT_GT(from_heel.dot(along), -radius);
  EXPECT_LT(from_heel.dot(along), foot + radius);
  EXPECT_LT(std::abs(along.x() * from_heel.y() - along.y() * from_heel.x()), 3e-4f);
  ASSERT_TRUE(contact.footprint.whole());
  ASSERT_GT(contact.footprint.width, 0u);
  const std::uint8_t least = *std::min_element(contact.footprint.gap.begin(), contact.footprint.gap.end());
  EXPECT_LT(Footprint::Decode(least), 1e-4f);
}

TEST_F(OnPad, TheContactMovesAsTheToolDoes) {
  const float depth = 0.0148f + scene_.tools[1].tip_radius_m;
  const Vec3f start = kCorner + Vec3f(0.003f, 0.005f, depth);
  for (int i = 0; i <= 30; ++i) To(start + Vec3f(0, 0, 1e-4f * static_cast<float>(30 - i)));
  std::optional<Vec2f> first, last;
  for (int i = 0; i <= 100; ++i) {
    const CauteryContact contact = To(start + Vec3f(4e-5f * static_cast<float>(i), 0, 0));
    ASSERT_TRUE(contact.on_solid) << i;
    EXPECT_LT((contact.material - last.value_or(contact.material)).norm(), 8e-5f) << i;
    first = first ? *first : contact.material;
    last = contact.material;
  }
  EXPECT_NEAR((*last - *first).norm(), 0.004f, 0.0003f);
}

TEST_F(OnPad, TheContactEndsWhenTheToolIsLifted) {
  const Vec3f at = kCorner + Vec3f(0.003f, 0.005f, 0.0148f + scene_.tools[1].tip_radius_m);
  for (int i = 0; i <= 30; ++i) To(at + Vec3f(0, 0, 1e-4f * static_cast<float>(30 - i)));
  ASSERT_TRUE(To(at).on_solid);
  CauteryContact contact;
  for (int i = 0; i <= 50; ++i) contact = To(at + Vec3f(0, 0, 1e-4f * static_cast<float>(i)));
  EXPECT_FALSE(contact.on_solid);
  EXPECT_EQ(contact.footprint.width, 0u);
}

/// Recordings, checkpoints and the processes of a cart must agree on the charts.
TEST_F(OnPad, TheChartsOfASceneStayAsTheyAre) {
  Hash64 hash;
  for (const SolidChart& chart : charts_.charts) {
    hash.AddValue(chart.x);
    hash.AddValue(chart.y);
    hash.AddValue(chart.solid);
  }
  hash.Add(std::span<const Index>(charts_.of_triangle));
  EXPECT_EQ(hash.value(), 2463002637463998298u) << "changed charts: a breaking change, see CHANGELOG";
}

TEST(SolidsBurn, NeedSolidsAHookAndTheAccurateModelOfHeat) {
  const scene::SceneData data = SeveralSolids();
  SceneView scene = data.View();
  EXPECT_TRUE(SolidsBurn(scene));
  scene.thermal.model = ThermalModel::kPaper;
  EXPECT_FALSE(SolidsBurn(scene));
  scene.thermal.model = ThermalModel::kAccurate;
  scene.tools[1].kind = ToolKind::kGrasper;
  EXPECT_FALSE(SolidsBurn(scene));
  scene = data.View();
  scene.tube_surface = {};
  EXPECT_FALSE(SolidsBurn(scene));
}

}  // namespace
}  // namespace fulcrum::physics
