// The thermal node and the surface of a solid: patches, events, Health and state over a restart.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/unit/thermal/node_fixture.h"
#include "thermal_node/protected/protected_structures.h"

namespace fulcrum::thermal {
namespace {

/// The flat membrane, and 20 mm beneath it a plate of 40 x 30 mm.
class NodeOverSolid : public ThermalNodeTest {
 protected:
  NodeOverSolid() {
    const auto first = static_cast<Index>(data_.rest_position.size());
    for (const Vec3f& p :
         {Vec3f(0, 0, -0.02f), Vec3f(0.04f, 0, -0.02f), Vec3f(0.04f, 0.03f, -0.02f), Vec3f(0, 0.03f, -0.02f)}) {
      data_.rest_position.push_back(p);
    }
    data_.tube_surface = {{first, first + 1, first + 2}, {first, first + 2, first + 3}};
    data_.fixed.tools[0].kind = ToolKind::kHook;
    scene_ = data_.View();
    chart_ = MakeSolidCharts(scene_).charts.at(0);
  }

  /// One tick with energised metal on the plate at (x, 15 mm).
  void Burn(ThermalNode* node, float x, CauteryMode mode = CauteryMode::kCoag, float power_W = 30) {
    const double time_s = tick_.session_time_s;
    bus_.Demand(mode, power_W, std::max(std::llround(1e9 * time_s) - 1000, 0LL));
    CauteryContact contact = TouchAt(chart_.Material({x, 0.015f, -0.02f}), 5e-4f);
    contact.touching = false;
    contact.on_solid = true;
    contact.session_time_s = time_s;
    contact.stamp = {++sequence_, 1, tick_.stamp_ns};
    ASSERT_TRUE(bus_.contact_out->Write(contact));
    Step(node);
  }

  SolidChart chart_;
};

TEST_F(NodeOverSolid, ABurnGivesAPatchOfItsOwnAtlasAndAnEvent) {
  auto node = MakeNode();
  auto patches = bus_.patches.MakeInput(256);
  for (int n = 0; n < 150; ++n) Burn(node.get(), 0.02f);
  for (int n = 0; n < 10; ++n) Step(node.get());
  EXPECT_GT(MetricOf(*node, "solid_burn_mm2"), 1.0);
  EXPECT_GT(MetricOf(*node, "highest_temperature_C"), 90.0);
  EXPECT_EQ(MetricOf(*node, "cut_length_mm"), 0.0);
  EXPECT_GT(MetricOf(*node, "delivered_J"), 0.0);
  EXPECT_EQ(MetricOf(*node, "delivered_J"), node->solids()->ledger().generator);
  EXPECT_LT(MetricOf(*node, "energy_closure"), 1e-3);
  EXPECT_EQ(node->solver().topology().revision(), 0u);

  int burns = 0;
  ThermalEvent event;
  while (bus_.event_in->TakeNext(&event)) {
    if (event.kind != ThermalEventKind::kSolidBurn) continue;
    ++burns;
    EXPECT_LT((event.material - chart_.Material({0.02f, 0.015f, -0.02f})).norm(), 2e-3f);
    EXPECT_GE(event.value, 1e-6f);
    EXPECT_EQ(event.solid, 0);
  }
  EXPECT_GE(burns, 1);

  const Vec2f at = chart_.Material({0.02f, 0.015f, -0.02f}) / kSolidCell_m;
  int of_solids = 0;
  TemperaturePatch patch, last;
  while (patches->TakeNext(&patch)) {
    if (patch.header.surface != BurntSurface::kSolids) continue;
    ++of_solids;
    EXPECT_GE(patch.header.slot, kPatchSlots);
    const bool contains = at.x() >= static_cast<float>(patch.header.origin_x) &&
                          at.x() < static_cast<float>(patch.header.origin_x + kPatchTexels) &&
                          at.y() >= static_cast<float>(patch.header.origin_y) &&
                          at.y() < static_cast<float>(patch.header.origin_y + kPatchTexels);
    if (contains) last = patch;
  }
  ASSERT_GT(of_solids, 5);
  ASSERT_FALSE(last.texels.empty());
  const auto x = static_cast<std::size_t>(at.x()) - last.header.origin_x;
  const auto y = static_cast<std::size_t>(at.y()) - last.header.origin_y;
  EXPECT_GT(last.texels[4 * (y * kPatchTexels + x) + 1], 200) << "damage beneath the metal";
}

/// A plate that is a ureter or a nerve is warned of once, over a restart, before it is injured.
class NodeOverStructure : public NodeOverSolid {
 protected:
  void WarnOnceThenInjure(SolidLook look, ThermalEventKind warning, ThermalEventKind injury);
};

void NodeOverStructure::WarnOnceThenInjure(SolidLook look, ThermalEventKind warning, ThermalEventKind injury) {
  std::vector<Solid> solids(1);
  solids[0].look = look;
  scene_.solids = solids;
  OpenCheckpoint();
  auto node = MakeNode();
  std::vector<ThermalEventKind> kinds;
  const auto take = [&] {
    ThermalEvent event;
    while (bus_.event_in->TakeNext(&event)) {
      if (event.solid != 0) continue;
      kinds.push_back(event.kind);
      if (event.kind == warning) {
        EXPECT_GE(event.temperature_C, kWarning_C);
        EXPECT_LT((event.material - chart_.Material({0.02f, 0.015f, -0.02f})).norm(), 2e-3f);
      }
    }
  };
  const auto count = [&](ThermalEventKind kind) { return std::ranges::count(kinds, kind); };
  for (int n = 0; n < 400 && count(warning) == 0; ++n) {
    Burn(node.get(), 0.02f, CauteryMode::kCoag, 2);
    take();
  }
  ASSERT_EQ(count(warning), 1);
  EXPECT_EQ(count(ThermalEventKind::kSolidBurn), 0) << "nothing is dead yet";
  EXPECT_EQ(MetricOf(*node, "warnings"), 1.0);
  for (int n = 0; n < 20; ++n) Step(node.get());  // Until the next checkpoint.
  node.reset();
  OpenCheckpoint();
  node = MakeNode();
  ASSERT_TRUE(node->restored());
  EXPECT_EQ(MetricOf(*node, "warnings"), 1.0);
  for (int n = 0; n < 150; ++n) Burn(node.get(), 0.02f);
  take();
  EXPECT_EQ(count(warning), 1);
  EXPECT_EQ(count(injury), 1);
  EXPECT_EQ(MetricOf(*node, "injuries"), 1.0);
}

TEST_F(NodeOverStructure, AUreterIsWarnedOfOnceBeforeItIsInjured) {
  WarnOnceThenInjure(SolidLook::kUreter, ThermalEventKind::kUreterWarning, ThermalEventKind::kUreterInjury);
}

TEST_F(NodeOverStructure, ANerveIsWarnedOfOnceBeforeItIsInjured) {
  WarnOnceThenInjure(SolidLook::kNerve, ThermalEventKind::kNerveWarning, ThermalEventKind::kNerveInjury);
}

TEST_F(NodeOverSolid, TheBurnOutlivesARestart) {
  OpenCheckpoint();
  auto node = MakeNode();
  for (int n = 0; n < 60; ++n) Burn(node.get(), 0.02f);
  const float before = node->solids()->dead_m2();
  ASSERT_GT(before, 0.0f);
  node.reset();
  OpenCheckpoint();
  node = MakeNode();
  ASSERT_TRUE(node->restored());
  EXPECT_NEAR(node->solids()->dead_m2(), before, 0.2f * before);
  EXPECT_GT(node->solids()->field().MaxTheta(), 20.0f);
  for (int n = 0; n < 20; ++n) Burn(node.get(), 0.02f);
  EXPECT_GE(node->solids()->dead_m2(), before);
}

/// The stroke of a restarted node goes on from the last contact: 0.2 s of it had no process.
TEST_F(NodeOverSolid, AStrokeGoesOnOverARestartWithoutABridge) {
  OpenCheckpoint();
  auto node = MakeNode();
  float x = 0.012f;
  const auto stroke = [&](int frames) {
    for (int n = 0; n < frames; ++n, x += 4e-5f) Burn(node.get(), x, CauteryMode::kCut, 35);
  };
  stroke(60);
  node.reset();
  for (int n = 0; n < 20; ++n, x += 4e-5f) Advance(&tick_);
  OpenCheckpoint();
  node = MakeNode();
  ASSERT_TRUE(node->restored());
  stroke(60);
  int open = 0, all = 0;
  for (float at = 0.0125f; at < x - 1e-3f; at += 1e-4f, ++all) {
    const Vec2f cell = chart_.Material({at, 0.015f, -0.02f}) / kSolidCell_m;
    const int ix = static_cast<int>(cell.x()), iy = static_cast<int>(cell.y());
    const Tile* tile = node->solids()->field().Find(ix / kTile, iy / kTile);
    open += tile != nullptr && (tile->state.flags[(iy % kTile) * kTile + ix % kTile] & kRemoved) != 0 ? 1 : 0;
  }
  EXPECT_GT(all, 40);
  EXPECT_GE(open, all - 1);
}

TEST_F(NodeOverSolid, MembraneAndSolidInTurnAreTwoPaths) {
  auto node = MakeNode();
  // The places are close in both materials, so a path from one to the other would be no jump.
  for (int n = 0; n < 40; ++n) {
    Cut(node.get(), 0.020f, 0.0201f);
    Burn(node.get(), 0.02f, CauteryMode::kCut, 35);
  }
  EXPECT_LT(MetricOf(*node, "cut_length_mm"), 2.0);
  EXPECT_LT(MetricOf(*node, "energy_closure"), 1e-3);
}

TEST_F(NodeOverSolid, WithoutContactTheStateHashIsThatOfTheMembraneAlone) {
  auto node = MakeNode();
  Cut(node.get(), 0.010f, 0.014f);
  EXPECT_EQ(NewestManifest().state_hash, node->solver().TickHash());
  for (int n = 0; n < 20; ++n) Burn(node.get(), 0.02f);
  EXPECT_NE(NewestManifest().state_hash, node->solver().TickHash());
}

TEST_F(NodeOverSolid, NeedsNoMembrane) {
  data_.membrane_material.clear();
  data_.membrane_rest_length.clear();
  data_.fixed.membrane.rows = data_.fixed.membrane.cols = 0;
  scene_ = data_.View();
  OpenCheckpoint();
  auto node = MakeNode();
  for (int n = 0; n < 60; ++n) Burn(node.get(), 0.02f);
  const float before = node->solids()->dead_m2();
  EXPECT_GT(before, 0.0f);
  const auto topology = NewestTopology();
  ASSERT_TRUE(topology);
  EXPECT_TRUE(bus::PassesGate(*topology));
  node.reset();
  OpenCheckpoint();
  node = MakeNode();
  EXPECT_TRUE(node->restored());
  EXPECT_NEAR(node->solids()->dead_m2(), before, 0.2f * before);
}

TEST_F(NodeOverSolid, BadSamplesAreRefusedAndCounted) {
  auto node = MakeNode();
  CauteryContact contact = TouchAt({1.5f, 0.1f}, 5e-4f);
  contact.touching = false;
  contact.on_solid = true;
  for (const Vec2f& at : {Vec2f(1.5f, 0.1f), Vec2f(-0.01f, 0.01f), Vec2f(0.0f, 0.0f)}) {
    contact.material = at;
    contact.stamp = {++sequence_, 1, tick_.stamp_ns};
    ASSERT_TRUE(bus_.contact_out->Write(contact));
    Step(node.get());
  }
  Cut(node.get(), 0.010f, 0.011f);  // For Health.
  EXPECT_EQ(MetricOf(*node, "contacts_refused"), 3.0);
  EXPECT_EQ(MetricOf(*node, "solid_burn_mm2"), 0.0);
}

}  // namespace
}  // namespace fulcrum::thermal
