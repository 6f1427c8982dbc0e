// Every topic through the real bus between two participants.
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <thread>

#include "services/bus/dds/participant.h"
#include "services/bus/dds/shared_memory.h"
#include "tests/unit/bus/same.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::bus {
namespace {

constexpr int kDomain = 11;

/// Waits for a condition that must come true; how long it takes is not what these tests judge.
template <class Condition>
bool Eventually(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

template <class T>
class EveryTopic : public testing::Test {};
using Types =
    testing::Types<HandleState, ToolState, TissueFrame, ContactModel, CauteryContact, TopologyState, TemperaturePatch,
                   ThermalEvent, SceneManifest, Command, CommandReply, TickManifest, Health>;
TYPED_TEST_SUITE(EveryTopic, Types);

TYPED_TEST(EveryTopic, ArrivesUnchanged) {
  DdsParticipant writer_side({.domain = kDomain, .node_name = "writer", .shared_memory = {}});
  DdsParticipant reader_side({.domain = kDomain, .node_name = "reader", .shared_memory = {}});
  auto out = writer_side.MakeOutput<TypeParam>();
  auto in = reader_side.MakeInput<TypeParam>();
  ASSERT_TRUE(Eventually([&] { return out->has_readers() && in->stats().matched; }));
  const auto sent = test::Sample<TypeParam>();
  ASSERT_TRUE(out->Write(sent));
  TypeParam got;
  ASSERT_TRUE(Eventually([&] { return in->TakeLatest(&got); }));
  EXPECT_TRUE(Same(sent, got));
  EXPECT_FALSE(in->TakeLatest(&got));
  EXPECT_EQ(in->stats().received, 1u);
  EXPECT_EQ(in->stats().rejected, 0u);
  EXPECT_EQ(out->stats().written, 1u);
  EXPECT_EQ(out->stats().failed, 0u);
}

}  // namespace
}  // namespace fulcrum::bus
