#include "services/base/core/generator_inputs.h"

#include <gtest/gtest.h>

#include <cmath>

namespace fulcrum {
namespace {

constexpr std::int64_t kMs = 1'000'000;

HandleState Pedals(std::int64_t ms, std::uint8_t pedals, std::uint64_t sequence = 0) {
  HandleState state;
  state.stamp = {sequence, 1, ms * kMs};
  state.pedals = pedals;
  return state;
}
GeneratorSetting Setting(std::int64_t ms, float cut_W) { return {{1, 1, ms * kMs}, cut_W, cut_W + 1, cut_W + 2}; }

TEST(GeneratorInputs, CutGoesBeforeBlendAndBlendBeforeCoag) {
  EXPECT_EQ(ModeOf(kPedalNone), CauteryMode::kOff);
  EXPECT_EQ(ModeOf(kPedalCoag), CauteryMode::kCoag);
  EXPECT_EQ(ModeOf(kPedalCoag | kPedalBlend), CauteryMode::kBlend);
  EXPECT_EQ(ModeOf(kPedalCoag | kPedalBlend | kPedalCut), CauteryMode::kCut);
}

TEST(GeneratorInputs, EachPedalHasItsPower) {
  const GeneratorSetting setting = Setting(0, 30);
  EXPECT_EQ(PowerOf(setting, CauteryMode::kOff), 0);
  EXPECT_EQ(PowerOf(setting, CauteryMode::kCut), 30);
  EXPECT_EQ(PowerOf(setting, CauteryMode::kCoag), 31);
  EXPECT_EQ(PowerOf(setting, CauteryMode::kBlend), 32);
}

TEST(GeneratorInputs, TellWhatWasTrueThenAndNotWhatCameLast) {
  GeneratorInputs inputs;
  inputs.Add(Setting(0, 30));
  inputs.Add(Pedals(10, kPedalNone));
  inputs.Add(Pedals(12, kPedalCut));
  inputs.Add(Pedals(14, kPedalCoag));
  inputs.Add(Setting(13, 50));
  EXPECT_EQ(inputs.At(9 * kMs).mode, CauteryMode::kOff) << "before the first sample";
  EXPECT_EQ(inputs.At(11 * kMs).mode, CauteryMode::kOff);
  EXPECT_EQ(inputs.At(12 * kMs).mode, CauteryMode::kCut);
  EXPECT_EQ(inputs.At(12 * kMs).power_W, 30);
  EXPECT_EQ(inputs.At(13 * kMs).power_W, 50);
  EXPECT_EQ(inputs.At(20 * kMs).mode, CauteryMode::kCoag);
  EXPECT_EQ(inputs.At(20 * kMs).power_W, 51);
}

TEST(GeneratorInputs, WithoutASettingThereIsNoPower) {
  GeneratorInputs inputs;
  inputs.Add(Pedals(10, kPedalCut));
  EXPECT_EQ(inputs.At(11 * kMs).mode, CauteryMode::kCut);
  EXPECT_EQ(inputs.At(11 * kMs).power_W, 0);
  // A late joiner receives only the newest setting; it is then used for earlier times, too.
  inputs.Add(Setting(20, 40));
  EXPECT_EQ(inputs.At(11 * kMs).power_W, 40);
}

TEST(GeneratorInputs, ASilentPedalIsUpUnlessBothEndsOfTheSilenceSayDown) {
  GeneratorInputs inputs;
  inputs.Add(Setting(0, 30));
  inputs.Add(Pedals(10, kPedalCut));
  EXPECT_EQ(inputs.At(110 * kMs).mode, CauteryMode::kCut);
  EXPECT_EQ(inputs.At(111 * kMs).mode, CauteryMode::kOff);
  inputs.Add(Pedals(500, kPedalCut));
  EXPECT_EQ(inputs.At(300 * kMs).mode, CauteryMode::kCut) << "the reader missed samples";
  inputs.Add(Pedals(900, kPedalNone));
  EXPECT_EQ(inputs.At(700 * kMs).mode, CauteryMode::kOff) << "when it went up is unknown";
  inputs.Add(Pedals(910, kPedalCut));
  inputs.Add(Pedals(2000, kPedalCut));
  EXPECT_EQ(inputs.At(1500 * kMs).mode, CauteryMode::kOff) << "the gap exceeds a second";
}

TEST(GeneratorInputs, NameEachSampleThatTheAnswerDependsOnOnce) {
  GeneratorInputs inputs;
  inputs.Add(Setting(0, 30));
  inputs.Add(Pedals(10, kPedalCut, 7));
  inputs.Add(Pedals(500, kPedalCut, 8));
  std::vector<ConsumedInput> consumed;
  (void)inputs.At(20 * kMs, &consumed);
  (void)inputs.At(30 * kMs, &consumed);
  ASSERT_EQ(consumed.size(), 2u);
  EXPECT_EQ(consumed[0].topic, TopicId::kHandleState);
  EXPECT_EQ(consumed[0].sequence, 7u);
  EXPECT_EQ(consumed[1].topic, TopicId::kGeneratorSetting);
  (void)inputs.At(300 * kMs, &consumed);
  ASSERT_EQ(consumed.size(), 3u);
  EXPECT_EQ(consumed[2].sequence, 8u);
}

TEST(GeneratorInputs, FromTheNamedSamplesAloneTheAnswersAreTheSame) {
  GeneratorInputs live, again;
  std::vector<HandleState> sent;
  live.Add(Setting(0, 30));
  again.Add(Setting(0, 30));
  for (int i = 0; i < 400; ++i) {
    if (i % 97 < 40) continue;  // Silences of 100 ms.
    sent.push_back(Pedals(static_cast<std::int64_t>(2.5 * i), i % 130 < 60 ? kPedalCut : kPedalCoag,
                          static_cast<std::uint64_t>(i)));
  }
  std::size_t next = 0;
  for (int ms = 0; ms < 1000; ms += 10) {
    for (; next < sent.size() && sent[next].stamp.stamp_ns <= (ms + 5) * kMs; ++next) live.Add(sent[next]);
    std::vector<ConsumedInput> consumed;
    const GeneratorDemand first = live.At(ms * kMs, &consumed);
    for (const ConsumedInput& input : consumed) {
      if (input.topic != TopicId::kHandleState) continue;
      for (const HandleState& state : sent) {
        if (state.stamp.sequence == input.sequence) again.Add(state);
      }
    }
    const GeneratorDemand second = again.At(ms * kMs);
    ASSERT_EQ(first.mode, second.mode) << ms;
    ASSERT_EQ(first.power_W, second.power_W) << ms;
    live.DropBefore(ms * kMs);
    again.DropBefore(ms * kMs);
  }
}

TEST(GeneratorInputs, GoOnFromACheckpoint) {
  GeneratorInputs before;
  before.Add(Setting(0, 30));
  before.Add(Pedals(10, kPedalCut));
  GeneratorInputs after;
  ASSERT_TRUE(after.Restore(before.Save()));
  after.Add(Pedals(400, kPedalCut));
  EXPECT_EQ(after.At(200 * kMs).mode, CauteryMode::kCut);
  EXPECT_EQ(after.At(200 * kMs).power_W, 30);
  GeneratorInputs none;
  ASSERT_TRUE(none.Restore(GeneratorInputs().Save()));
  EXPECT_FALSE(none.has_setting());
}

TEST(GeneratorInputs, ARuinedCheckpointIsRefused) {
  GeneratorInputs inputs;
  GeneratorInputs::State state = inputs.Save();
  state.pedals = 0x80;
  EXPECT_FALSE(inputs.Restore(state));
  for (const float bad : {NAN, -1.0f, 301.0f}) {
    state = inputs.Save();
    state.coag_W = bad;
    EXPECT_FALSE(inputs.Restore(state)) << bad;
  }
}

}  // namespace
}  // namespace fulcrum
