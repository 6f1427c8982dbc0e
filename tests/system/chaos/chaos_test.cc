// One cart, as a user starts it, with one fault after another while it pulls and cuts. After each it must recover by
// itself; at the end the session succeeds, no published state is lost, all numbers are valid, the force stays within
// its limits, and nothing is left in shared memory.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <numeric>
#include <string>
#include <thread>
#include <utility>

#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "tests/support/datagram_flood.h"
#include "tests/support/pace_faults.h"
#include "tests/support/session_bus.h"
#include "tests/system/chaos/chaos_cart.h"
#include "tests/system/chaos/small_room.h"

namespace fulcrum {
namespace {

using testing::CartState;
using testing::ChaosCart;
using testing::Damage;
using testing::Flood;
using testing::Program;

constexpr int kDomain = 81;
constexpr double kSession_s = 120;  // Never reached.
constexpr double kPatience_s = 30;
constexpr double kRounding_N = 1e-3;

std::uint64_t Rejected(const CartState& state) {
  return std::accumulate(state.rejected.begin(), state.rejected.end(), std::uint64_t{0});
}

/// Number of samples of a topic that a node reports as refused.
std::uint64_t RefusedBy(const CartState& state, NodeId node, TopicId topic) {
  for (const InputHealth& input : state.healths.at(node).inputs) {
    if (input.topic == topic) return input.rejected;
  }
  return 0;
}

class Chaos : public ::testing::Test {
 protected:
  /// Exit code of the session after Ctrl-C.
  int End() {
    chaos_.cart().Signal(SIGINT);
    return chaos_.cart().WaitForEnd(kPatience_s).value_or(-1);
  }
  void KillEachNode();
  void StopEachNode();
  void Flooded();
  void FloodedFromOutsideOfTheBus();
  void SpoilCheckpoints();
  void RefuseASecondCart();

  ChaosCart chaos_{kSession_s, kDomain, 7};
};

void Chaos::KillEachNode() {
  for (const NodeId node : testing::kNodes) {
    chaos_.WaitAMoment(0.3);
    chaos_.Kill(node);
  }
  EXPECT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
}

void Chaos::StopEachNode() {
  for (const NodeId node : testing::kNodes) {
    chaos_.Stop(node, 0.2);  // Longer than the other nodes wait for its messages.
    chaos_.WaitAMoment(0.1);
  }
  EXPECT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
}

void Chaos::Flooded() {
  EXPECT_EQ(chaos_.watch().See(Rejected), 0u) << "the cart itself has sent an invalid number";
  for (const Flood flood : {Flood::kToolState, Flood::kContactModel}) {
    EXPECT_GT(chaos_.Pour(flood, 0.4), 1000u);
  }
  EXPECT_GT(chaos_.PourBytes(50), 100u);
  EXPECT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
  EXPECT_TRUE(chaos_.watch().WaitUntil(kPatience_s, [](const CartState& state) {
    return RefusedBy(state, NodeId::kPhysics, TopicId::kToolState) > 100 &&
           RefusedBy(state, NodeId::kHaptics, TopicId::kContactModel) > 100;
  }));
  const auto rejected = [](const CartState& state) { return state.rejected; };
  // What is left of the flood has been read when nothing is refused for a while.
  auto before = chaos_.watch().See(rejected);
  EXPECT_TRUE(testing::WaitFor(kPatience_s, [&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const auto now = chaos_.watch().See(rejected);
    return std::exchange(before, now) == now;
  })) << "samples are refused long after the flood";
  EXPECT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
  EXPECT_EQ(chaos_.watch().See(rejected), before) << "samples are refused after the flood";
}

void Chaos::FloodedFromOutsideOfTheBus() {
  const std::size_t before = chaos_.cart().Said().size();
  EXPECT_EQ(testing::FloodDomain(kDomain, 20'000, 1, 7), 20'000u);
  EXPECT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
  const std::string said = chaos_.cart().Said().substr(before);
  for (const char* death : {" killed by signal ", " ended with exit code "}) {
    EXPECT_EQ(said.find(death), std::string::npos) << "a malformed datagram has ended a process: " << said;
  }
}

TEST_F(Chaos, TheSessionOutlivesItsFaults) {
  ASSERT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
  {
    SCOPED_TRACE("each node killed");
    KillEachNode();
  }
  chaos_.SetWallClock(5);
  {
    SCOPED_TRACE("each node stopped for a while");
    StopEachNode();
  }
  {
    SCOPED_TRACE("no processor time");
    chaos_.Starve(1);
    EXPECT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
  }
  chaos_.watch().See([](const CartState& state) {
    EXPECT_EQ(state.topology_lost, 0u);
    EXPECT_LE(state.tissue_lost_s, 0.15);
    EXPECT_GT(state.topology.cut_length_m, 0.005f) << "the cut continued meanwhile";
  });
  chaos_.SetWallClock(-7);
  {
    SCOPED_TRACE("flooded");
    Flooded();
  }
  {
    SCOPED_TRACE("flooded with datagrams");
    FloodedFromOutsideOfTheBus();
  }
  {
    SCOPED_TRACE("spoiled checkpoints");
    SpoilCheckpoints();
  }
  RefuseASecondCart();
  // Random bytes that happen to decode do not have the session's number: they count as samples of another session on
  // its bus, which is the only fault beside the pace of this machine. Whether some decode depends on the time at which
  // they arrive.
  const int code = End();
  const std::string said = chaos_.cart().Said();
  const std::string faults = testing::FaultsButPace(said);
  EXPECT_EQ(code, said.find("\nfault at ") != std::string::npos ? 1 : 0) << chaos_.Trouble() << said;
  EXPECT_TRUE(faults.empty() || faults.find("samples of another session") != std::string::npos) << faults << said;
  EXPECT_LE(std::count(faults.begin(), faults.end(), '\n'), 1) << faults;
  const CartState state = chaos_.watch().See([](const CartState& s) { return s; });
  EXPECT_EQ(state.force_verdict(), "");
  EXPECT_LE(state.peak_force_N(), 3.3 + kRounding_N);
  EXPECT_LE(state.peak_step_N(), 0.4 + kRounding_N);
  EXPECT_FALSE(std::filesystem::exists(bus::SharedMemoryDirectory(kDomain)));
  EXPECT_EQ(chaos_.clock().waits, 0u) << "a program waits for a time of the wall clock";
}

void Chaos::SpoilCheckpoints() {
  chaos_.KillAndSpoil(NodeId::kPhysics, Damage::kFlippedNewest);
  chaos_.KillAndSpoil(NodeId::kThermal, Damage::kOfTheFuture);
  EXPECT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
  EXPECT_NE(chaos_.Log(NodeId::kPhysics).find("altered from outside: the node goes on"), std::string::npos);
  EXPECT_NE(chaos_.Log(NodeId::kThermal).find("replaced, the node begins anew"), std::string::npos);
}

void Chaos::RefuseASecondCart() {
  Program second("fulcrum", {"up", chaos_.scene(), "--domain", std::to_string(kDomain), "--out",
                             chaos_.scene().parent_path() / "second"});
  EXPECT_EQ(second.End(0), 2);
  EXPECT_NE(second.Said().find("a session runs in domain 81"), std::string::npos) << second.Said();
  EXPECT_TRUE(chaos_.GoesOn()) << chaos_.Trouble();
}

TEST(ChaosSchema, APeerOfAnotherSchemaEndsTheSessionAndBothSidesSaySo) {
  ChaosCart chaos(kSession_s, kDomain + 1, 1);
  ASSERT_TRUE(chaos.GoesOn()) << chaos.Trouble();
  bus::DdsSettings settings = testing::WriterOf(kDomain + 1, "old_node");
  settings.schema_hash = 0x1234;
  bus::DdsParticipant other(settings);
  EXPECT_TRUE(testing::WaitFor(kPatience_s, [&] { return !other.schema_mismatch().empty(); }));
  EXPECT_EQ(chaos.cart().WaitForEnd(kPatience_s), 3) << chaos.Trouble();
  EXPECT_NE(chaos.cart().Said().find("schema mismatch"), std::string::npos) << chaos.cart().Said();
}

class ChaosRoom : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!testing::CanMakeRoom())
      GTEST_SKIP() << "this user may not create namespaces, so there are no small file systems";
    std::filesystem::create_directories(out_);
  }
  void TearDown() override { std::filesystem::remove_all(out_); }
  /// Expects the cart with such a file system to be refused with `words`.
  void ExpectRefused(const std::filesystem::path& place, const std::string& options, const std::string& words) {
    testing::SmallRoom room(place, options, "small", kDomain + 2, out_);
    EXPECT_EQ(room.up().End(0), 2) << room.up().Said();
    EXPECT_NE(room.up().Said().find(words), std::string::npos) << room.up().Said();
  }

  const std::filesystem::path out_ =
      std::filesystem::temp_directory_path() / ("fulcrum-room-" + std::to_string(::getpid()));
};

TEST_F(ChaosRoom, ACartWithoutRoomIsRefusedWithOneLine) {
  ExpectRefused("/dev/shm", "size=20m", "has 20 MiB free, at least 32 MiB are needed");
  ExpectRefused(out_, "size=64k", "session folder: ");
  ExpectRefused(out_, "ro", "Read-only file system");
}

}  // namespace
}  // namespace fulcrum
