// Use of contacts, pedals and generator settings in the thermal node, on in-process ports.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "tests/unit/thermal/node_fixture.h"

namespace fulcrum::thermal {
namespace {

TEST_F(ThermalNodeTest, SamplesOfATimeThatWasAppliedArePassedOver) {
  auto node = MakeNode();
  Cut(node.get(), 0.010f, 0.012f);
  const double last_s = tick_.session_time_s;
  Touch(node.get(), 0.012f);
  Step(node.get());
  const double joule = node->solver().ledger().joule;
  // A restarted physics node repeats the last tenth of a second, a restarted thermal node reads the newest samples.
  for (int back = 10; back >= 0; --back) {
    Send(0.011f, last_s - 0.01 * back);
    Step(node.get());
  }
  EXPECT_EQ(node->solver().ledger().joule, joule);
}

TEST_F(ThermalNodeTest, EveryContactIsConsumedAndNamedInTheManifest) {
  auto node = MakeNode();
  for (int n = 0; n < 3; ++n) Send(0.010f + 4e-5f * static_cast<float>(n), 0.01 * n);
  Step(node.get());
  const TickManifest manifest = NewestManifest();
  for (const TopicId topic : {TopicId::kCauteryContact, TopicId::kHandleState, TopicId::kGeneratorSetting}) {
    std::vector<std::uint64_t> sequences;
    for (const ConsumedInput& input : manifest.consumed) {
      if (input.topic == topic) sequences.push_back(input.sequence);
    }
    EXPECT_EQ(sequences, (std::vector<std::uint64_t>{1, 2, 3}));
  }
  EXPECT_GT(node->solver().ledger().joule, 0.0);
  Step(node.get());
  EXPECT_TRUE(NewestManifest().consumed.empty());
}

TEST_F(ThermalNodeTest, OfManyContactsTheLaterOnesWaitForTheNextFrame) {
  auto node = MakeNode();
  for (int n = 0; n < 12; ++n) Send(0.010f + 4e-5f * static_cast<float>(n), 0.01 * n);
  Step(node.get());
  const std::vector<std::uint64_t> first = NewestConsumed(TopicId::kCauteryContact);
  ASSERT_EQ(first.size(), kMostSamples);
  EXPECT_EQ(first.front(), 1u);
  Step(node.get());
  const std::vector<std::uint64_t> second = NewestConsumed(TopicId::kCauteryContact);
  ASSERT_EQ(second.size(), 12 - kMostSamples);
  EXPECT_EQ(second.front(), kMostSamples + 1);
  EXPECT_EQ(second.back(), 12u);
}

TEST_F(ThermalNodeTest, WithoutAGeneratorSettingThereIsNoCurrentAndHealthSaysSo) {
  auto node = MakeNode();
  demands_ = false;
  HandleState down;
  down.stamp = {1, 1, 0};
  down.pedals = kPedalCut;
  ASSERT_TRUE(bus_.handle_out->Write(down));
  for (int n = 0; n < 5; ++n) Touch(node.get(), 0.010f);
  EXPECT_EQ(node->solver().ledger().joule, 0.0);
  Health health;
  node->FillHealth(&health);
  EXPECT_NE(health.last_error.find("GeneratorSetting"), std::string::npos) << health.last_error;
  // The pedal is up again, and nothing was heated.
  down.stamp = {2, 1, tick_.stamp_ns};
  down.pedals = kPedalNone;
  ASSERT_TRUE(bus_.handle_out->Write(down));
  for (int n = 0; n < 2; ++n) Touch(node.get(), 0.010f);
  health = {};
  node->FillHealth(&health);
  EXPECT_EQ(health.last_error, "");
}

TEST_F(ThermalNodeTest, HealthShowsNoPowerWhileNoContactsCome) {
  auto node = MakeNode();
  for (int n = 0; n < 10; ++n) Touch(node.get(), 0.010f);
  EXPECT_GT(MetricOf(*node, "power_W"), 0);
  EXPECT_EQ(MetricOf(*node, "set_power_W"), 35);
  EXPECT_GT(MetricOf(*node, "voltage_V"), 10);
  (void)node->TakeSettingChanged();
  for (int n = 0; n < 5; ++n) Step(node.get());
  EXPECT_EQ(MetricOf(*node, "set_power_W"), 35) << "a gap of 50 ms between two contacts";
  for (int n = 0; n < 10; ++n) Step(node.get());
  ASSERT_TRUE(node->solver().stepped()) << "the tissue is still warm";
  for (const char* name : {"power_W", "set_power_W", "voltage_V"}) EXPECT_EQ(MetricOf(*node, name), 0) << name;
  EXPECT_TRUE(node->TakeSettingChanged());
}

TEST_F(ThermalNodeTest, HealthFollowsTheHookThatCoolsAboveColdTissue) {
  auto node = MakeNode();
  for (int n = 0; n < 10; ++n) Touch(node.get(), 0.010f);
  for (int n = 0; n < 3000 && node->solver().stepped(); ++n) Step(node.get());
  ASSERT_FALSE(node->solver().stepped());
  const double hook_C = MetricOf(*node, "hook_temperature_C");
  ASSERT_GT(hook_C, 37.5);
  for (int n = 0; n < 100; ++n) Step(node.get());
  // A second of the hook's 16; Health is a tenth of a second old at most.
  const double now_C = node->solver().figures().hook_C;
  EXPECT_LT(now_C - 37, 0.95 * (hook_C - 37));
  EXPECT_NEAR(MetricOf(*node, "hook_temperature_C"), now_C, 0.01 * (hook_C - 37));
}

TEST_F(ThermalNodeTest, TheFilmOfSteamCollapsesWhereTheMetalLeavesTheTissue) {
  auto node = MakeNode();
  Cut(node.get(), 0.010f, 0.012f);
  ASSERT_GT(node->solver().metal().film, 0.5f);
  for (int n = 0; n < 3; ++n) Lift(node.get());
  EXPECT_LT(node->solver().metal().film, 0.01f) << "exp(-6) after 30 ms";
  EXPECT_EQ(node->solver().metal().burning, 1.0f);
  for (int n = 0; n < 97; ++n) Lift(node.get());
  EXPECT_EQ(node->solver().metal().film, 0.0f);
}

TEST_F(ThermalNodeTest, APedalThatFallsSilentIsUp) {
  auto node = MakeNode();
  Touch(node.get(), 0.010f);
  demands_ = false;
  const double begun = node->solver().ledger().generator;
  for (int n = 0; n < 10; ++n) Touch(node.get(), 0.010f);
  const double heard = node->solver().ledger().generator;
  EXPECT_GT(heard, begun);
  for (int n = 0; n < 10; ++n) Touch(node.get(), 0.010f);
  EXPECT_LT(node->solver().ledger().generator - heard, 0.02 * (heard - begun) + 0.4) << "at most a frame of 35 W";
}

TEST_F(ThermalNodeTest, ANewSettingIsTakenAtItsTime) {
  auto node = MakeNode();
  for (int n = 0; n < 5; ++n) Touch(node.get(), 0.010f);
  EXPECT_TRUE(node->TakeSettingChanged());
  EXPECT_FALSE(node->TakeSettingChanged());
  EXPECT_EQ(node->solver().figures().set_power_W, 35);
  demands_ = false;
  bus_.Demand(CauteryMode::kCut, 50, std::llround(1e9 * (tick_.session_time_s + 0.015)));
  Touch(node.get(), 0.010f);
  EXPECT_EQ(node->solver().figures().set_power_W, 35) << "not yet";
  for (int n = 0; n < 2; ++n) Touch(node.get(), 0.010f);
  EXPECT_EQ(node->solver().figures().set_power_W, 50);
  EXPECT_TRUE(node->TakeSettingChanged());
}

TEST_F(ThermalNodeTest, OneThatComesBackWaitsForThePedalOfTheContactsItMissed) {
  // Energy [J] that a node applies to the contacts of 0.2 s in which it did not run, once it has received the next
  // HandleState.
  const auto energy = [&](CauteryMode mode_after) {
    std::filesystem::remove(folder_ / "thermal_node.checkpoint");
    tick_ = {};
    demands_ = true;
    OpenCheckpoint();
    auto node = MakeNode();
    Cut(node.get(), 0.010f, 0.012f);
    node.reset();
    OpenCheckpoint();
    // Twenty contacts without a HandleState, which follows them.
    demands_ = false;
    double time_s = tick_.session_time_s;
    for (int n = 0; n < 20; ++n, time_s += 0.01) Send(0.012f + 8e-5f * static_cast<float>(n), time_s);
    tick_.session_time_s = time_s;
    tick_.stamp_ns = std::llround(1e9 * time_s);
    node = MakeNode();
    EXPECT_TRUE(node->restored());
    Step(node.get());
    EXPECT_TRUE(NewestConsumed(TopicId::kCauteryContact).empty());
    bus_.Demand(mode_after, 35, tick_.stamp_ns);
    const double before = node->solver().ledger().generator;
    for (int n = 0; n < 4; ++n) Step(node.get());
    return node->solver().ledger().generator - before;
  };
  const double down = energy(CauteryMode::kCut), up = energy(CauteryMode::kOff);
  EXPECT_GT(up, 0.5) << "the pedal counts as down for a tenth of a second after its last sample";
  EXPECT_GT(down, 1.5 * up) << "the pedal is down at both ends of the gap";
}

TEST_F(ThermalNodeTest, ContactsThatComeTwoByTwoCutWhatTheyCutOneByOne) {
  // 12 mm at 8 mm/s; in the second run thermal steps at every other contact.
  const auto cut = [&](int at_once) {
    tick_ = {};
    auto node = MakeNode();
    for (int n = 0; n < 150; ++n) {
      Send(0.010f + 8e-5f * static_cast<float>(n), 0.01 * n);
      if (n % at_once == at_once - 1) Step(node.get());
    }
    for (int n = 0; n < 20 * kCommitFrames; ++n) Step(node.get());  // The length follows the slit.
    return std::pair(node->solver().cut_length_m(), node->solver().ledger().joule);
  };
  const auto [length_m, joule] = cut(1);
  const auto [length2_m, joule2] = cut(2);
  EXPECT_GT(length_m, 0.011f);
  EXPECT_NEAR(length2_m, length_m, 0.0015f);
  // Conduction and source alternate over steps of twice the length, and conduction has half the time.
  EXPECT_NEAR(joule2, joule, 0.1 * joule);
}

TEST_F(ThermalNodeTest, ContactOfNoNumbersIsCountedAndChangesNothing) {
  auto node = MakeNode();
  Step(node.get());
  const std::uint64_t before = node->solver().FullHash();
  for (const float bad : {NAN, INFINITY, -INFINITY}) Touch(node.get(), bad);
  EXPECT_EQ(bus_.contact_in->stats().rejected, 3u);
  EXPECT_EQ(node->solver().FullHash(), before);
  Touch(node.get(), 0.01f);  // the next valid contact is used
  EXPECT_TRUE(node->solver().stepped());
}

TEST_F(ThermalNodeTest, ContactOffTheSheetIsRefusedAndCounted) {
  auto node = MakeNode();
  Touch(node.get(), 0.5f);
  Touch(node.get(), 0.01f);
  Health health;
  node->FillHealth(&health);
  EXPECT_EQ(health.metrics.back().name, "contacts_refused");
  EXPECT_EQ(health.metrics.back().value, 1);
}

TEST_F(ThermalNodeTest, RefusedContactsAreCountedWhileNothingIsHeated) {
  auto node = MakeNode();
  Touch(node.get(), 0.5f);
  EXPECT_EQ(MetricOf(*node, "contacts_refused"), 1);
  Touch(node.get(), 0.5f);
  EXPECT_EQ(MetricOf(*node, "contacts_refused"), 2);
  EXPECT_FALSE(node->solver().stepped());
}

}  // namespace
}  // namespace fulcrum::thermal
