// Each fault more often than in the default tests, at random moments. A failure names its seed; FULCRUM_CHAOS_SEED
// sets it.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>

#include "services/transport/bus/dds/shared_memory.h"
#include "tests/system/chaos/chaos_cart.h"
#include "tests/system/chaos/small_room.h"

namespace fulcrum {
namespace {

using testing::CartState;
using testing::ChaosCart;
using testing::Damage;
using testing::Flood;
using testing::SmallRoom;

constexpr int kDomain = 85;
constexpr double kSession_s = 300;  // Never reached.
constexpr double kPatience_s = 30;
constexpr double kRounding_N = 1e-3;

std::uint32_t Seed() {
  const char* given = std::getenv("FULCRUM_CHAOS_SEED");
  return given != nullptr ? static_cast<std::uint32_t>(std::strtoul(given, nullptr, 10)) : std::random_device()();
}

TEST(ChaosMatrix, FaultsInAnyOrder) {
  const std::uint32_t seed = Seed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  ChaosCart chaos(kSession_s, kDomain, seed);
  ASSERT_TRUE(chaos.GoesOn()) << chaos.Trouble();
  constexpr int kRounds = 25;
  for (int round = 0; round < kRounds; ++round) {
    const NodeId node = testing::kNodes[random() % testing::kNodes.size()];
    const double seconds = std::uniform_real_distribution<double>(0.01, 2.5)(random);
    const unsigned fault = random() % 7;
    SCOPED_TRACE("round " + std::to_string(round) + ": fault " + std::to_string(fault) + ", " + NodeName(node) + ", " +
                 std::to_string(seconds) + " s");
    switch (fault) {
      case 0:
      case 1:
        chaos.Kill(node);
        break;
      case 2:
      case 3:
        chaos.Stop(node, seconds);
        break;
      case 4:
        chaos.Starve(seconds);
        break;
      case 5:
        chaos.SetWallClock(std::uniform_real_distribution<double>(-12, 12)(random));
        break;
      default:
        EXPECT_GT(chaos.Pour(static_cast<Flood>(random() % 3), seconds), 0u);
    }
    chaos.WaitAMoment(1);
    ASSERT_TRUE(chaos.GoesOn()) << chaos.Trouble();
  }
  EXPECT_GT(chaos.PourBytes(1000), 1000u);
  ASSERT_TRUE(chaos.GoesOn()) << chaos.Trouble();
  chaos.cart().Signal(SIGINT);
  EXPECT_EQ(chaos.cart().FaultAtEnd(kPatience_s), "") << chaos.Trouble();
  const CartState state = chaos.watch().See([](const CartState& s) { return s; });
  EXPECT_EQ(state.force_verdict(), "");
  EXPECT_LE(state.peak_force_N(), 3.3 + kRounding_N);
  EXPECT_LE(state.peak_step_N(), 0.4 + kRounding_N);
  EXPECT_EQ(state.topology_lost, 0u);
  EXPECT_LE(state.tissue_lost_s, 0.15);
  EXPECT_FALSE(std::filesystem::exists(bus::SharedMemoryDirectory(kDomain)));
}

class EveryDamage : public ::testing::TestWithParam<Damage> {};

// State in the checkpoint is lost: the tissue is whole again and the jaws are empty. The session continues.
TEST_P(EveryDamage, OfACheckpointIsToldAndSurvived) {
  ChaosCart chaos(kSession_s, kDomain + 1, 1);
  ASSERT_TRUE(chaos.GoesOn()) << chaos.Trouble();
  const auto both_slots_are_sealed = [](const CartState& state) {
    return state.seals.at(NodeId::kThermal).sequence >= 2 && state.seals.at(NodeId::kPhysics).sequence >= 2;
  };
  ASSERT_TRUE(chaos.watch().WaitUntil(kPatience_s, both_slots_are_sealed));
  for (const NodeId node : {NodeId::kThermal, NodeId::kPhysics}) {
    chaos.KillAndSpoil(node, GetParam());
    const bool told = testing::WaitFor(kPatience_s, [&] {
      const std::string log = chaos.Log(node);
      return log.find("begins anew") != std::string::npos ||
             log.find("goes on from what is whole") != std::string::npos;
    });
    EXPECT_TRUE(told) << chaos.Log(node);
  }
  const std::uint64_t revision = chaos.watch().See([](const CartState& state) { return state.topology.revision; });
  EXPECT_TRUE(chaos.watch().WaitUntil(kPatience_s, [&](const CartState& state) {
    return state.topology.revision > revision;
  })) << "nothing is cut any more";
  chaos.cart().Signal(SIGINT);
  EXPECT_EQ(chaos.cart().FaultAtEnd(kPatience_s), "") << chaos.Trouble();
  EXPECT_EQ(chaos.watch().See([](const CartState& state) { return state.force_verdict(); }), "");
}

INSTANTIATE_TEST_SUITE_P(Checkpoint, EveryDamage,
                         ::testing::Values(Damage::kFlippedNewest, Damage::kFlippedAll, Damage::kCutShort,
                                           Damage::kOfTheFuture, Damage::kOfAnotherScene));

class Filled : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!testing::CanMakeRoom())
      GTEST_SKIP() << "this user may not create namespaces, so there are no small file systems";
    std::filesystem::create_directories(out_);
  }
  void TearDown() override { std::filesystem::remove_all(out_); }
  static bool SaysThatItCuts(const SmallRoom& room) {
    return testing::WaitFor(kPatience_s, [&] {
      const std::string log = testing::ReadFile(room.Inside(room.out() / "latest/logs/physics_node.log"));
      return log.find("joined session") != std::string::npos;
    });
  }

  const std::filesystem::path out_ =
      std::filesystem::temp_directory_path() / ("fulcrum-filled-" + std::to_string(::getpid()));
};

// Logs and pictures are lost, and the verdict reports it; checkpoints have reserved their room at the start.
TEST_F(Filled, DiskIsReportedAndTheSessionGoesOn) {
  SmallRoom room(out_, "size=64m", "small", kDomain + 2, out_);
  ASSERT_TRUE(SaysThatItCuts(room)) << room.up().Said();
  EXPECT_GT(room.Fill(), 1u << 20);
  EXPECT_EQ(room.up().End(0), 1) << room.up().Said();
  EXPECT_NE(room.up().Said().find("! not well: render_node could not write"), std::string::npos) << room.up().Said();
  EXPECT_NE(room.up().Said().find("cannot write the picture"), std::string::npos) << room.up().Said();
}

// Running processes have their memory and continue; a start that needs new memory is refused with one line.
TEST_F(Filled, SharedMemoryHurtsNobodyWhoRuns) {
  SmallRoom room("/dev/shm", "size=80m", "small", kDomain + 2, out_);
  ASSERT_TRUE(SaysThatItCuts(room)) << room.up().Said();
  EXPECT_GT(room.Fill(), 1u << 20);
  EXPECT_EQ(room.up().End(0), 0) << room.up().Said();
}

}  // namespace
}  // namespace fulcrum
