// Outputs of the thermal node, its state over a restart, and the edges that it severs, on in-process ports.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/numerics/thermal/topology_validator.h"
#include "tests/unit/thermal/node_fixture.h"

namespace fulcrum::thermal {
namespace {

TEST_F(ThermalNodeTest, CutGivesTopologyEventsPatchesAndMetrics) {
  auto node = MakeNode();
  auto patches = bus_.patches.MakeInput(64);
  Step(node.get());
  const auto first = NewestTopology();
  ASSERT_TRUE(first);  // late joiners always receive one
  EXPECT_EQ(first->revision, 0u);
  EXPECT_EQ(first->scene_hash, scene_.hash);
  Cut(node.get(), 0.010f, 0.020f);
  for (int n = 0; n < 10; ++n) Step(node.get());

  const auto cut = NewestTopology();
  ASSERT_TRUE(cut);
  EXPECT_GT(cut->revision, 5u);
  EXPECT_NEAR(cut->cut_length_m, 0.010f, 0.001f);
  // Row 10 at t = 10 mm is in the slit: its nodes are dead, edges down from row 9 are.
  EXPECT_TRUE(TestBit(cut->dead_nodes, 10 * 41 + 15));
  EXPECT_TRUE(TestBit(cut->dead_edges, 3 * (9 * 41 + 15) + 1));
  EXPECT_FALSE(TestBit(cut->dead_edges, 3 * (5 * 41 + 15) + 1));

  std::vector<int> seen(16, 0);
  ThermalEvent event;
  std::uint64_t last = 0;
  while (bus_.event_in->TakeNext(&event)) {
    ++seen[static_cast<int>(event.kind)];
    EXPECT_EQ(event.stamp.sequence, ++last);
  }
  EXPECT_EQ(seen[static_cast<int>(ThermalEventKind::kContact)], 1);
  EXPECT_GE(seen[static_cast<int>(ThermalEventKind::kSteam)], 1);
  EXPECT_GE(seen[static_cast<int>(ThermalEventKind::kCut)], 5);
  EXPECT_EQ(seen[static_cast<int>(ThermalEventKind::kBlanch)], 1);

  TemperaturePatch patch;
  ASSERT_TRUE(patches->TakeLatest(&patch));
  EXPECT_GE(patch.header.topology_revision + 1, cut->revision) << "frames that commit send no patch";
  EXPECT_EQ(patch.texels[4 * (102 * kPatchTexels + 150) + 3], 0);

  const auto metric = [&](const std::string& name) { return MetricOf(*node, name); };
  EXPECT_NEAR(metric("highest_temperature_C"), 100, 10);
  EXPECT_NEAR(metric("cut_length_mm"), 10, 1);
  EXPECT_EQ(metric("burn_depth_mm"), 0);
  EXPECT_GT(metric("dead_edges"), 20);
  EXPECT_EQ(metric("warnings"), 0);
  EXPECT_EQ(metric("injuries"), 0);
  EXPECT_LT(metric("energy_closure"), 1e-4);
}

TEST_F(ThermalNodeTest, ACutThatIsReportedAfterTheMetalHasLeftHasItsPlace) {
  auto node = MakeNode();
  // Faster than the published length follows.
  for (float s = 0.010f; s < 0.016f; s += 1.4e-4f) Touch(node.get(), s);
  ThermalEvent event;
  while (bus_.event_in->TakeNext(&event)) {
  }
  for (int n = 0; n < 60; ++n) Lift(node.get());
  int cuts = 0;
  while (bus_.event_in->TakeNext(&event)) {
    if (event.kind != ThermalEventKind::kCut) continue;
    ++cuts;
    EXPECT_LT((event.material - Vec2f(0.016f, 0.0102f)).norm(), 1e-3f);
  }
  EXPECT_GT(cuts, 0);
}

TEST_F(ThermalNodeTest, RestartGoesOnWithTheSameTopologyAndHeat) {
  OpenCheckpoint();
  auto node = MakeNode();
  EXPECT_FALSE(node->restored());
  Cut(node.get(), 0.010f, 0.016f);
  const auto before = NewestTopology();
  ASSERT_TRUE(before);
  const double stored = node->solver().field().Stored();
  node.reset();  // as after kill -9: nothing is written at the end
  OpenCheckpoint();
  node = MakeNode();
  EXPECT_TRUE(node->restored());
  EXPECT_NEAR(node->solver().field().Stored(), stored, 0.3 * stored);  // at most 0.1 s older
  Step(node.get());
  const auto after = NewestTopology();
  ASSERT_TRUE(after);
  EXPECT_EQ(after->revision, before->revision);
  EXPECT_EQ(after->dead_edges, before->dead_edges);
  EXPECT_EQ(after->dead_nodes, before->dead_nodes);
  EXPECT_EQ(after->shrink, before->shrink);
  EXPECT_GT(after->stamp.epoch, before->stamp.epoch);
  Cut(node.get(), 0.016f, 0.020f);
  const auto later = NewestTopology();
  ASSERT_TRUE(later);
  EXPECT_GT(later->revision, before->revision);
}

TEST_F(ThermalNodeTest, MetalThatMovedOnDuringAnOutageLeavesNoBridge) {
  OpenCheckpoint();
  auto node = MakeNode();
  Cut(node.get(), 0.010f, 0.0147f);
  node.reset();
  // Restarted after 0.3 s, in which the hook continued at 8 mm/s.
  tick_.index += 30;
  tick_.session_time_s += 0.3;
  tick_.stamp_ns += 300'000'000;
  OpenCheckpoint();
  node = MakeNode();
  ASSERT_TRUE(node->restored());
  Cut(node.get(), 0.0171f, 0.020f);
  const HeatField& field = node->solver().field();
  for (float s = 0.0105f; s < 0.0195f; s += 1e-4f) {
    const CellIndex cell = field.sheet().CellOf({s, 0.0102f});
    const Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
    ASSERT_NE(tile, nullptr) << s;
    EXPECT_NE(tile->state.flags[(cell.iy % kTile) * kTile + cell.ix % kTile] & kRemoved, 0)
        << "not removed at s = " << s;
  }
}

TEST_F(ThermalNodeTest, TornEdgesOfOneTriangleAreJoinedToOneCrack) {
  auto node = MakeNode();
  const Index cols = scene_.membrane.cols, cell = 10 * cols + 20;
  TearState tears;
  tears.stamp = {1, 1, 1};
  tears.scene_hash = scene_.hash;
  tears.rows = scene_.membrane.rows;
  tears.cols = cols;
  tears.torn_edges.assign((3 * scene_.membrane.node_count() + 7) / 8, 0);
  SetBit(tears.torn_edges, 3 * cell);           // Along the row,
  SetBit(tears.torn_edges, 3 * cell + 2);       // the diagonal,
  SetBit(tears.torn_edges, 3 * (cell + cols));  // and the row below: across the cell.
  ASSERT_TRUE(bus_.tear_out->Write(tears));
  for (int n = 0; n < kCommitFrames; ++n) Step(node.get());
  const HeatField& field = node->solver().field();
  const auto at = [&](Index n) { return scene_.membrane_material[n]; };
  const Vec2f from = 0.5f * (at(cell) + at(cell + 1)), to = 0.5f * (at(cell + cols) + at(cell + cols + 1));
  for (float u = 0.02f; u < 1.0f; u += 0.02f) {
    const CellIndex place = field.sheet().CellOf(from + u * (to - from));
    const auto removed = [&](int dx) {
      const Tile* tile = field.Find((place.ix + dx) / kTile, place.iy / kTile);
      return tile != nullptr && (tile->state.flags[place.iy % kTile * kTile + (place.ix + dx) % kTile] & kRemoved) != 0;
    };
    EXPECT_TRUE(removed(0) || removed(-1) || removed(1)) << u;
  }
}

TEST_F(ThermalNodeTest, PaperModelRunsInTheSameNodeAndComesBack) {
  scene_.thermal.model = ThermalModel::kPaper;
  OpenCheckpoint();
  auto node = MakeNode();
  auto patches = bus_.patches.MakeInput(64);
  Cut(node.get(), 0.010f, 0.016f);
  const auto before = NewestTopology();
  ASSERT_TRUE(before);
  EXPECT_TRUE(TestBit(before->dead_nodes, 10 * 41 + 13));
  TemperaturePatch patch;
  ASSERT_TRUE(patches->TakeLatest(&patch));
  const std::size_t texel = 4 * (102 * kPatchTexels + 130);
  EXPECT_EQ(patch.texels[texel + 3], 0);
  EXPECT_EQ(patch.texels[texel + 4 * kPatchTexels * 10 + 1], 0);  // no history of damage
  node.reset();
  OpenCheckpoint();
  node = MakeNode();
  EXPECT_TRUE(node->restored());
  Step(node.get());
  const auto after = NewestTopology();
  ASSERT_TRUE(after);
  EXPECT_EQ(after->revision, before->revision);
  EXPECT_EQ(after->dead_nodes, before->dead_nodes);
  EXPECT_EQ(after->shrink, before->shrink);
}

TEST_F(ThermalNodeTest, IdleNodeSendsNothingButItsManifest) {
  auto patches = bus_.patches.MakeInput(4);
  auto node = MakeNode();
  for (int n = 0; n < 300; ++n) Step(node.get());
  EXPECT_EQ(bus_.topology_out->stats().written, 1u);
  EXPECT_EQ(bus_.patch_out->stats().written, 0u);
  EXPECT_EQ(bus_.event_out->stats().written, 0u);
  EXPECT_EQ(bus_.manifest_out->stats().written, 300u);
}

TEST_F(ThermalNodeTest, WithoutReadersNoPatchIsBuiltAndALateReaderGetsAll) {
  auto node = MakeNode();
  Cut(node.get(), 0.010f, 0.012f);
  EXPECT_EQ(bus_.patch_out->stats().written, 0u);
  auto patches = bus_.patches.MakeInput(4);
  for (int n = 0; n < 8; ++n) Step(node.get());
  TemperaturePatch patch;
  EXPECT_TRUE(patches->TakeLatest(&patch));
}

TEST_F(ThermalNodeTest, SeversWhatHasTornWhereAllIsIdle) {
  OpenCheckpoint();
  auto node = MakeNode();
  for (int n = 0; n < 3; ++n) Step(node.get());
  (void)NewestTopology();
  TopologyValidator validator(scene_, node->solver().field().sheet());
  // Along a row, a column and a diagonal.
  const Index cols = scene_.membrane.cols;
  TearState tears;
  tears.stamp = {1, 1, 1};
  tears.scene_hash = scene_.hash;
  tears.rows = scene_.membrane.rows;
  tears.cols = cols;
  tears.torn_edges.assign((3 * scene_.membrane.node_count() + 7) / 8, 0);
  const Index torn[] = {3 * (10 * cols + 20), 3 * (15 * cols + 5) + 1, 3 * (20 * cols + 30) + 2};
  for (const Index edge : torn) SetBit(tears.torn_edges, edge);
  TearState of_another = tears;
  of_another.scene_hash ^= 1;
  ASSERT_TRUE(bus_.tear_out->Write(of_another));
  for (int n = 0; n < kCommitFrames; ++n) Step(node.get());
  EXPECT_FALSE(NewestTopology()) << "tears of another scene have no effect";
  ASSERT_TRUE(bus_.tear_out->Write(tears));
  Step(node.get());
  TickManifest manifest;
  ASSERT_TRUE(bus_.manifest_in->TakeLatest(&manifest));
  ASSERT_EQ(manifest.consumed.size(), 1u);
  EXPECT_EQ(manifest.consumed[0].topic, TopicId::kTearState);
  EXPECT_EQ(manifest.consumed[0].sequence, tears.stamp.sequence);
  for (int n = 1; n < kCommitFrames; ++n) Step(node.get());
  const auto topology = NewestTopology();
  ASSERT_TRUE(topology) << "at the next commit";
  for (const Index edge : torn) EXPECT_TRUE(TestBit(topology->dead_edges, edge)) << edge;
  EXPECT_EQ(node->solver().topology().dead_edge_count(), 3u) << "and no others";
  EXPECT_EQ(node->solver().topology().dead_node_count(), 0u);
  EXPECT_EQ(validator.Check(node->solver()), "");
  EXPECT_EQ(node->solver().cut_length_m(), 0.0f) << "a tear does not count as a cut";

  // The same message again, also after a restart, changes nothing.
  node.reset();
  OpenCheckpoint();
  node = MakeNode();
  EXPECT_TRUE(node->restored());
  const auto restored = node->solver().topology().revision();
  EXPECT_EQ(restored, topology->revision);
  ASSERT_TRUE(bus_.tear_out->Write(tears));
  for (int n = 0; n < 2 * kCommitFrames; ++n) Step(node.get());
  EXPECT_EQ(node->solver().topology().revision(), restored);
  EXPECT_EQ(validator.Check(node->solver()), "");
}

TEST_F(ThermalNodeTest, SameInputsGiveTheSameHashes) {
  const auto run = [&] {
    sequence_ = 0;
    tick_ = {};
    auto node = MakeNode();
    Cut(node.get(), 0.010f, 0.014f);
    const TickManifest manifest = NewestManifest();
    EXPECT_EQ(manifest.node, NodeId::kThermal);
    const auto contact = std::ranges::find(manifest.consumed, TopicId::kCauteryContact, &ConsumedInput::topic);
    EXPECT_TRUE(contact != manifest.consumed.end() && contact->sequence == sequence_);
    return manifest.state_hash;
  };
  EXPECT_EQ(run(), run());
}

TEST_F(ThermalNodeTest, TellsPhysicsWhatIsGoneAroundTheHook) {
  auto node = MakeNode();
  const Sheet& sheet = node->solver().field().sheet();
  OpenCells cells;
  int before = 0;
  for (int n = 0; n < 60; ++n) {
    Send(0.010f + 4e-5f * static_cast<float>(n), 0.01 * n);
    Step(node.get());
    if (!bus_.open_in->TakeLatest(&cells)) continue;
    EXPECT_EQ(cells.scene_hash, scene_.hash);
    int count = 0;
    for (int j = 0; j < kOpenWindow; ++j) {
      for (int i = 0; i < kOpenWindow; ++i) {
        const CellIndex cell{cells.x + i - sheet.origin_x, cells.y + j - sheet.origin_y};
        const Tile* tile = node->solver().field().Find(cell.ix / kTile, cell.iy / kTile);
        const int k = (cell.iy % kTile) * kTile + cell.ix % kTile;
        const bool removed = tile != nullptr && (tile->state.flags[k] & kRemoved) != 0;
        ASSERT_EQ(cells.IsOpen(cells.x + i, cells.y + j), removed) << i << ", " << j;
        count += removed ? 1 : 0;
      }
    }
    EXPECT_GE(count, before);
    before = count;
  }
  EXPECT_GT(before, 50);
  // Without changes nothing is sent.
  for (int n = 60; n < 70; ++n) Step(node.get());
  EXPECT_FALSE(bus_.open_in->TakeLatest(&cells));
}

}  // namespace
}  // namespace fulcrum::thermal
