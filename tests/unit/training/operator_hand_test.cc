// A script as a hand performs it.
#include "services/scene/builder/operator_hand.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>

#include "services/base/core/error.h"
#include "services/base/core/operator_script.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::scene {
namespace {

const std::vector<ScriptKey> kScript{
    {0, 1, Vec3f::Zero(), 0.8f, kPedalNone, 0},
    {2, 1, Vec3f(0.05f, 0, 0), 0, kPedalCut, 35},
    {4, 1, Vec3f(0.05f, 0.02f, 0), 0, kPedalNone, 0},
};

double RmsOff(const std::vector<ScriptKey>& performed) {
  double sum = 0;
  for (const ScriptKey& key : performed) {
    sum += (key.p_W - EvaluateScript(kScript, 1, static_cast<double>(key.time_s)).p_W).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(performed.size()));
}

TEST(OperatorHand, TrembleAndStrayingHaveTheStatedSize) {
  OperatorHand hand;
  hand.tremor_m = 0.4e-3;
  hand.drift_m = 0.9e-3;
  // The values vary by up to a quarter with the seed, and straying completes few turns in six seconds.
  double sum = 0;
  constexpr int kSeeds = 50;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    hand.seed = seed;
    sum += RmsOff(Perform(kScript, hand, 6));
  }
  EXPECT_NEAR(sum / kSeeds, std::sqrt(3.0) * std::hypot(0.4e-3, 0.9e-3), 0.15e-3);
}

TEST(OperatorHand, IsTheSameForTheSameSeedAndAnotherForAnother) {
  OperatorHand hand = *HandNamed("novice");
  hand.seed = 3;
  const auto first = Perform(kScript, hand, 6), again = Perform(kScript, hand, 6);
  ASSERT_EQ(first.size(), again.size());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].p_W, again[i].p_W);
  hand.seed = 4;
  EXPECT_NE(Perform(kScript, hand, 6)[100].p_W, first[100].p_W);
}

TEST(OperatorHand, StrictlyInTimeAndALateHandIsLateWithToolPedalAndJaw) {
  OperatorHand late;
  late.lag_s = 0.2;
  late.pedal_lag_s = 0.4;
  const auto performed = Perform(kScript, late, 6);
  double down_s = -1, up_s = -1;
  for (std::size_t i = 1; i < performed.size(); ++i) {
    EXPECT_GT(performed[i].time_s, performed[i - 1].time_s);
    if (performed[i].pedals != 0 && down_s < 0) down_s = static_cast<double>(performed[i].time_s);
    if (performed[i].pedals == 0 && down_s >= 0 && up_s < 0) up_s = static_cast<double>(performed[i].time_s);
  }
  EXPECT_GE(down_s, 2 + 0.75 * 0.6);
  EXPECT_LE(down_s, 2 + 1.25 * 0.6 + 0.02);
  EXPECT_NEAR(up_s - down_s, 2, 0.021);
  EXPECT_LT((performed.back().p_W - kScript.back().p_W).norm(), 1e-6f);
}

std::vector<ScriptKey> LongScript(int keys) {
  std::vector<ScriptKey> script;
  for (std::uint32_t tool : {0u, 1u}) {
    for (int i = 0; i < keys; ++i) {
      const float time_s = 0.02f * static_cast<float>(i);
      script.push_back({time_s, tool, Vec3f(time_s, 0, 0), 0, kPedalNone, static_cast<float>(i % 100)});
    }
  }
  return script;
}

TEST(Script, IsReadBetweenTheKeysAroundTheTime) {
  constexpr int kKeys = 180001;
  const std::vector<ScriptKey> script = LongScript(kKeys);
  for (const std::uint32_t tool : {0u, 1u}) {
    for (int i = 0; i + 1 < kKeys; i += 4999) {
      const ScriptKey* a = &script[tool * kKeys + static_cast<std::size_t>(i)];
      const double time_s = 0.5 * (static_cast<double>(a->time_s) + static_cast<double>((a + 1)->time_s));
      const std::array two{a[0], a[1]};
      const ScriptPoint of_all = EvaluateScript(script, tool, time_s), of_two = EvaluateScript(two, tool, time_s);
      EXPECT_EQ(of_all.p_W, of_two.p_W) << i;
      EXPECT_EQ(of_all.power_W, of_two.power_W) << i;
      EXPECT_EQ(EvaluateScript(script, tool, static_cast<double>(a->time_s)).p_W, a->p_W) << "at a key";
    }
  }
  EXPECT_FALSE(EvaluateScript(script, 2, 1).present);
  EXPECT_EQ(EvaluateScript(script, 0, 1e6).p_W, script[kKeys - 1].p_W);
}

/// The servo asks each millisecond, however long the session is.
TEST(Script, CostsTheSameHoweverLongItIs) {
  const auto seconds = [](const std::vector<ScriptKey>& script) {
    const auto now = [] {
      timespec t{};
      ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
      return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    };
    const double last_s = static_cast<double>(script.back().time_s), begin = now();
    float sum = 0;
    for (int i = 0; i < 2000; ++i) sum += EvaluateScript(script, 1, last_s * i / 2000).p_W.x();
    EXPECT_GT(sum, 0);
    return now() - begin;
  };
  const std::vector<ScriptKey> one = LongScript(301), many = LongScript(180001);
  (void)seconds(one);
  EXPECT_LT(seconds(many), 60 * seconds(one)) << "600 times as many keys";
}

TEST(OperatorHand, IsNamedInTheSceneAndOnTheCommandLine) {
  const auto file = std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes/line.yaml";
  const auto scene = ReadSceneYaml(file, {}, {"script.hand=novice", "script.seed=7"});
  ASSERT_TRUE(scene.settings.hand);
  EXPECT_EQ(scene.settings.hand->seed, 7u);
  EXPECT_FALSE(ReadSceneYaml(file, {}, {}).settings.hand);
  try {
    (void)ReadSceneYaml(file, {}, {"script.hand=surgeon"});
    ADD_FAILURE() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("expert, novice"), std::string::npos) << error.what();
  }
  EXPECT_THROW((void)ReadSceneYaml(file, {}, {"script.duration_s=3"}), InputError);
}

}  // namespace
}  // namespace fulcrum::scene
