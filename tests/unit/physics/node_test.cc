// The node on in-process ports.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "physics_node/node/physics_checkpoint.h"
#include "physics_node/node/physics_node.h"
#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "tests/support/whole_topology.h"
#include "tests/unit/physics/node_bench.h"

namespace fulcrum::physics {
namespace {

TEST_F(PhysicsNodeTest, WithoutReadersNothingIsSent) {
  Bench bench(scene_, nullptr);
  bench.Play(0, 0.3);
  EXPECT_EQ(bench.frame_out_->stats().written, 0u);
  EXPECT_EQ(bench.contact_out_->stats().written, 0u);
  EXPECT_EQ(bench.cautery_out_->stats().written, 0u);
  EXPECT_EQ(bench.manifest_out_->stats().written, 0u);
}

TEST_F(PhysicsNodeTest, LateStepsMakeItCheaperForAWhile) {
  Bench bench(scene_, nullptr);
  bench.Play(0, 0.1);
  EXPECT_EQ(bench.Figure("cheaper_presets"), -1);
  bench.tick_.index += 3;
  bench.Step();
  EXPECT_EQ(bench.Figure("cheaper_presets"), 1) << "default -> fast";
  bench.tick_.index += 3;
  bench.Step();
  EXPECT_EQ(bench.Figure("cheaper_presets"), 1) << "There is no preset below fast.";
  for (int i = 0; i < 201; ++i) {
    bench.Step();
  }
  EXPECT_EQ(bench.Figure("cheaper_presets"), -1);
}

TEST_F(PhysicsNodeTest, SkippedPeriodsAreSimulatedButNotAStandstill) {
  Bench bench(scene_, nullptr);
  const auto advance_ms = [&](std::uint64_t skipped) {
    const double before_s = bench.node_.simulation().simulated_time_s();
    bench.tick_.index += skipped;
    bench.Step();
    return std::lround(1e3 * (bench.node_.simulation().simulated_time_s() - before_s));
  };
  EXPECT_EQ(advance_ms(40), 10) << "the first step has no predecessor";
  EXPECT_EQ(advance_ms(0), 10);
  EXPECT_EQ(advance_ms(1), 20);
  EXPECT_EQ(advance_ms(2), 30);
  EXPECT_EQ(bench.Figure("time_lost_s"), -1);
  EXPECT_EQ(advance_ms(100), 30);
  EXPECT_NEAR(bench.Figure("time_lost_s"), 0.98, 1e-6);
}

TEST_F(PhysicsNodeTest, TellsEachReaderWhatItNeeds) {
  Bench bench(scene_, nullptr);
  auto frames = bench.bus_.frames.MakeInput();
  auto contacts = bench.bus_.contacts.MakeInput();
  auto cautery = bench.bus_.cautery.MakeInput();
  auto manifests = bench.bus_.manifests.MakeInput();
  bench.Play(0, 3.0);
  TissueFrame frame;
  ASSERT_TRUE(frames->TakeLatest(&frame));
  EXPECT_EQ(frame.header.vertex_count, scene_.rest_position.size());
  EXPECT_EQ(frame.header.scene_hash, 77u);
  EXPECT_EQ(frame.header.tool_sequence, 300u);
  EXPECT_EQ(frame.header.handle_sequence, 300u);
  EXPECT_EQ(frame.header.grasping_tools, 1u);
  ContactModel model;
  ASSERT_TRUE(contacts->TakeLatest(&model));
  EXPECT_EQ(model.tool_sequence, 300u);
  EXPECT_EQ(model.tool_stamp_ns, 1 + 2'990'000'000);
  EXPECT_EQ(model.devices[0].contacts[0].kind, ContactKind::kGrasp);
  CauteryContact contact;
  ASSERT_TRUE(cautery->TakeLatest(&contact));
  EXPECT_TRUE(contact.touching);
  EXPECT_GE(contact.footprint.width, 5u);
  EXPECT_NEAR(contact.session_time_s, 2.99, 1e-9);
  TickManifest manifest;
  ASSERT_TRUE(manifests->TakeLatest(&manifest));
  EXPECT_EQ(manifest.tick, 299u);
  EXPECT_EQ(manifest.state_hash, bench.node_.simulation().StateHash());
  ASSERT_EQ(manifest.consumed.size(), 5u);
  EXPECT_EQ(manifest.consumed[0].topic, TopicId::kToolState);
  EXPECT_EQ(manifest.consumed[0].sequence, 300u);
  EXPECT_EQ(manifest.consumed[1].topic, TopicId::kToolState);
  EXPECT_EQ(manifest.consumed[1].sequence, 300u) << "no later sample had arrived";
  EXPECT_EQ(manifest.consumed[2].topic, TopicId::kHandleState);
  EXPECT_EQ(manifest.consumed[2].sequence, 300u);
  EXPECT_EQ(manifest.consumed[3].topic, TopicId::kTopologyState);
  EXPECT_EQ(manifest.consumed[4].topic, TopicId::kOpenCells);
  EXPECT_GT(bench.Figure("max_displacement_mm"), 5.0);
  EXPECT_GT(bench.Figure("grasped_particles"), 0.0);
  EXPECT_EQ(bench.Figure("quarantined"), 0.0);
}

TEST_F(PhysicsNodeTest, PosesAreThoseOfItsOwnMomentHoweverLateItIsWoken) {
  const Vec3f start = scene_.tools[1].p_WP + Vec3f(0, 0, -0.02f), per_ms(1e-4f, 0, 0);
  const auto run = [&](std::int64_t late_ns, std::uint64_t* hash) {
    Bench bench(scene_, nullptr);
    auto manifests = bench.bus_.manifests.MakeInput();
    // A sample every millisecond, offset from the steps by half a millisecond.
    std::int64_t ms = 1;
    for (std::uint64_t k = 0; k < 20; ++k) {
      const std::int64_t woken_ns = static_cast<std::int64_t>(k) * kPeriod + late_ns;
      for (; ms * 1'000'000 - 500'000 <= woken_ns; ++ms) {
        bench.SendTool(1, start + static_cast<float>(ms) * per_ms, 1 + ms * 1'000'000 - 500'000);
      }
      bench.StepAt(k, late_ns);
    }
    TickManifest manifest;
    EXPECT_TRUE(manifests->TakeLatest(&manifest));
    *hash = manifest.state_hash;
    EXPECT_EQ(manifest.consumed[1].sequence, manifest.consumed[0].sequence + 1) << "the samples around its moment";
    return bench.ToolPlace(1);
  };
  std::uint64_t soon_hash = 0, late_hash = 0;
  const Vec3f soon = run(1'200'000, &soon_hash), late = run(7'900'000, &late_hash);
  EXPECT_LT((soon - (start + 190.5f * per_ms)).norm(), 2e-6f);  // rounding: metres in float, and of u
  EXPECT_EQ(soon, late);
  EXPECT_EQ(soon_hash, late_hash);
}

TEST_F(PhysicsNodeTest, AStepThatIsWokenAtItsVeryMomentIsThatMoments) {
  // 0.29 / 0.01 is less than 29 in double.
  Bench bench(scene_, nullptr);
  auto cautery = bench.bus_.cautery.MakeInput();
  CauteryContact contact;
  for (int k = 0; k < 100; ++k) {
    bench.Step();
    ASSERT_TRUE(cautery->TakeLatest(&contact));
    ASSERT_NEAR(contact.session_time_s, 0.01 * k, 1e-9);
  }
}

TEST_F(PhysicsNodeTest, AStepThatIsWokenInTheNextPeriodIsStillItsOwn) {
  Bench bench(scene_, nullptr);
  auto cautery = bench.bus_.cautery.MakeInput();
  CauteryContact contact;
  const auto moment = [&](std::uint64_t index, std::int64_t late_ns) {
    bench.StepAt(index, late_ns);
    EXPECT_TRUE(cautery->TakeLatest(&contact));
    return contact.session_time_s;
  };
  // The first step runs late and has no reference; the next one corrects it.
  EXPECT_NEAR(moment(0, 10'300'000), 0.01, 1e-9);
  EXPECT_NEAR(moment(1, 1'200'000), 0.01, 1e-9);
  EXPECT_NEAR(moment(2, 1'200'000), 0.02, 1e-9);
  EXPECT_NEAR(moment(3, 10'300'000), 0.03, 1e-9) << "0.2 ms before its successor";
  EXPECT_NEAR(moment(4, 1'200'000), 0.04, 1e-9);
  EXPECT_NEAR(moment(7, 1'200'000), 0.07, 1e-9) << "periods were skipped";
}

TEST_F(PhysicsNodeTest, AWriterOfPosesThatIsStartedAnewIsFollowed) {
  Bench bench(scene_, nullptr);
  const Vec3f start = scene_.tools[1].p_WP + Vec3f(0, 0, -0.02f), moved = start + Vec3f(0, 0.003f, 0);
  bench.SendTool(1, start, 1, 5);
  bench.StepAt(0, 1'000'000);
  bench.StepAt(1, 1'000'000);
  EXPECT_EQ(bench.ToolPlace(1), start);
  bench.sequence_ = 0;
  bench.SendTool(1, moved, 1 + 15'000'000, 6);
  bench.StepAt(2, 1'000'000);
  EXPECT_EQ(bench.ToolPlace(1), moved);
}

TEST_F(PhysicsNodeTest, HoldsItsToolsWhenTheInputGoesStale) {
  Bench bench(scene_, nullptr);
  bench.Play(0, 2.5);
  ASSERT_TRUE(bench.node_.simulation().grasp(0).holding());
  const Vec3f tip = bench.node_.simulation().Save().pose[0].p_WT;
  for (int i = 0; i < 200; ++i) {
    bench.Step();
  }
  EXPECT_TRUE(bench.node_.simulation().grasp(0).holding());
  EXPECT_EQ(bench.node_.simulation().Save().pose[0].p_WT, tip);
  bench.Play(4.0, 4.5);  // It continues after the tool has reappeared elsewhere.
  EXPECT_TRUE(bench.node_.simulation().grasp(0).holding());
}

TEST_F(PhysicsNodeTest, AppliesTopologyOfItsSceneOnly) {
  Bench bench(scene_, nullptr);
  TopologyState state = WholeTopology(scene_);
  state.stamp = {1, 1, 1};
  state.scene_hash = 78;
  state.revision = 5;
  SetBit(state.dead_nodes, 40 * 25 + 12);
  bench.topology_out_->Write(state);
  bench.Step();
  EXPECT_EQ(bench.node_.simulation().model().revision(), 0u);
  EXPECT_EQ(bench.Figure("topology_refused"), 1.0);
  state.scene_hash = 77;
  state.stamp.sequence = 2;
  bench.topology_out_->Write(state);
  bench.Step();
  EXPECT_EQ(bench.node_.simulation().model().revision(), 5u);
  EXPECT_FALSE(bench.node_.simulation().model().NodeAlive(40 * 25 + 12));
}

class PhysicsRestart : public PhysicsNodeTest {
 protected:
  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("physics_restart_" + std::to_string(getpid()) + ".checkpoint");
  void TearDown() override { std::filesystem::remove(file_); }
  [[nodiscard]] std::unique_ptr<runtime::CheckpointFile> Open() const {
    return std::make_unique<runtime::CheckpointFile>(
        file_, scene_.hash, kCheckpointLayout, CheckpointCapacity(static_cast<Index>(scene_.rest_position.size())));
  }
};

TEST_F(PhysicsRestart, GoesOnWhereItWasKilled) {
  std::vector<float> before(3 * scene_.rest_position.size()), after(before.size());
  std::size_t held = 0;
  {
    auto checkpoint = Open();
    Bench bench(scene_, checkpoint.get());
    EXPECT_FALSE(bench.node_.restored());
    bench.Play(0, 2.8);
    bench.node_.simulation().particles().CopyPositions(before);
    held = bench.node_.simulation().grasp(0).held().size();
    ASSERT_GT(held, 0u);
  }
  auto checkpoint = Open();
  Bench bench(scene_, checkpoint.get(), 2);
  EXPECT_TRUE(bench.node_.restored());
  EXPECT_EQ(bench.node_.simulation().grasp(0).held().size(), held);
  for (int i = 0; i < 5; ++i) {
    bench.Step();  // Inputs are not available again yet.
  }
  bench.Play(2.8, 3.0);
  bench.node_.simulation().particles().CopyPositions(after);
  float jump = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    jump = std::max(jump, std::abs(after[i] - before[i]));
  }
  EXPECT_LT(jump, 0.0015f);
  EXPECT_TRUE(bench.node_.simulation().grasp(0).holding());
}

/// The script stretches the membrane of the small scene to 2.2.
TEST_F(PhysicsRestart, NeitherForgetsNorRepeatsWhatHasTorn) {
  scene_.physics.tear_stretch = 1.8f;
  TearState before, after;
  {
    auto checkpoint = Open();
    Bench bench(scene_, checkpoint.get());
    auto tears = bench.bus_.tears.MakeInput();
    bench.Play(0, 1.0);
    EXPECT_FALSE(tears->TakeLatest(&before)) << "without a tear nothing is published";
    // Stops in the tick of the first tear.
    while (bench.node_.simulation().tears().torn_count() == 0 && bench.tick_.index < 500) {
      const double now_s = 0.01 * static_cast<double>(bench.tick_.index);
      bench.Play(now_s, now_s + 0.01);
    }
    ASSERT_TRUE(tears->TakeLatest(&before));
    EXPECT_EQ(before.scene_hash, scene_.hash);
    EXPECT_EQ(before.rows, scene_.membrane.rows);
    EXPECT_EQ(before.stamp.sequence, 1u);
    EXPECT_GT(bench.Figure("torn_edges"), 0);
    EXPECT_GE(bench.Figure("largest_stretch"), 1.8);
    for (Index edge = 0; edge < 3 * scene_.membrane.node_count(); ++edge) {
      if (!TestBit(before.torn_edges, edge)) continue;
      EXPECT_TRUE(bench.node_.simulation().model().EdgeAlive(edge / 3, static_cast<int>(edge % 3)))
          << "holds until the owner of the topology has severed it";
    }
  }
  auto checkpoint = Open();
  Bench bench(scene_, checkpoint.get(), 2);
  ASSERT_TRUE(bench.node_.restored());
  auto tears = bench.bus_.tears.MakeInput();
  for (int i = 0; i < 50; ++i) bench.Step();
  ASSERT_TRUE(tears->TakeNext(&after)) << "a late reader gets the newest state";
  EXPECT_EQ(after.torn_edges, before.torn_edges);
  EXPECT_FALSE(tears->TakeNext(&after)) << "once";
}

TEST_F(PhysicsNodeTest, WarnsBeforeTheMembraneTears) {
  scene_.physics.tear_stretch = 2.2f;
  Bench bench(scene_, nullptr);
  bench.Play(0, 4);
  Health health;
  bench.node_.FillHealth(&health);
  EXPECT_EQ(health.last_error.rfind("membrane near tearing: stretch 2.0", 0), 0u)
      << health.last_error << "; largest stretch " << bench.Figure("largest_stretch");
  EXPECT_EQ(bench.Figure("torn_edges"), 0);
}

TEST_F(PhysicsNodeTest, OneWarningDoesNotHideAnother) {
  scene_.physics.tear_stretch = 2.2f;
  Bench bench(scene_, nullptr);
  bench.Play(0, 4);
  TopologyState other = WholeTopology(scene_);
  other.scene_hash = scene_.hash + 1;
  other.revision = 1;
  bench.bus_.topology.MakeOutput()->Write(other);
  bench.Play(4, 4.01);
  Health health;
  bench.node_.FillHealth(&health);
  EXPECT_EQ(health.last_error.rfind("TopologyState or OpenCells of another scene refused; membrane near tearing", 0),
            0u)
      << health.last_error;
}

TEST_F(PhysicsRestart, GoesTheWayOfTheOutageAndDatesItsContactsByIt) {
  Vec3f before = Vec3f::Zero();
  Quatf turn = Quatf::Identity();
  {
    auto checkpoint = Open();
    Bench bench(scene_, checkpoint.get());
    bench.Play(0, 2.81);  // The last step writes a checkpoint.
    before = bench.ToolPlace(1);
    turn = bench.node_.simulation().Save().pose[1].q_WT;
  }
  auto checkpoint = Open();
  Bench bench(scene_, checkpoint.get());
  ASSERT_TRUE(bench.node_.restored());
  auto cautery = bench.bus_.cautery.MakeInput();
  CauteryContact contact;
  bench.tick_.index = 310;
  bench.SendTool(1, before + Vec3f(0, 0.002f, 0), 1 + 309 * kPeriod, 1, turn);
  bench.Step();
  EXPECT_FALSE(cautery->TakeLatest(&contact)) << "no handle sample has arrived";
  EXPECT_EQ(bench.ToolPlace(1), before) << "without it the tool must not move";
  float longest = 0;
  double last_s = 2.8;
  for (int i = 0; i < 40; ++i) {
    const Vec3f place = bench.ToolPlace(1);
    bench.SendHandle(1 + static_cast<std::int64_t>(bench.tick_.index) * kPeriod);
    bench.Step();
    longest = std::max(longest, (bench.ToolPlace(1) - place).norm());
    ASSERT_TRUE(cautery->TakeLatest(&contact)) << i;
    EXPECT_GT(contact.session_time_s, last_s) << "time continues from the checkpoint";
    EXPECT_NEAR(contact.session_time_s - last_s, 0.0175, i == 0 ? 0.01 : 1e-6) << "evenly";
    last_s = contact.session_time_s;
  }
  EXPECT_LT(longest, 0.00015f) << "2 mm in 40 steps";
  EXPECT_NEAR(last_s, 3.50, 1e-6);
  EXPECT_LT((bench.ToolPlace(1) - before - Vec3f(0, 0.002f, 0)).norm(), 1e-6f);
}

TEST_F(PhysicsRestart, ABrokenCheckpointIsAFreshStart) {
  {
    auto checkpoint = Open();
    auto slot = checkpoint->Begin();
    std::fill_n(slot.begin(), 4000, std::byte{0x7f});
    checkpoint->Commit(4000);
  }
  auto checkpoint = Open();
  Bench bench(scene_, checkpoint.get());
  EXPECT_FALSE(bench.node_.restored());
  bench.Play(0, 0.1);
}

}  // namespace
}  // namespace fulcrum::physics
