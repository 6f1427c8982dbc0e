// Profile of a scene: the figures are plausible, and the advice follows from them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "physics_node/profile/forecast.h"
#include "physics_node/profile/scene_profile.h"
#include "services/base/core/error.h"
#include "services/scene/builder/build.h"

namespace fulcrum::physics {
namespace {

TEST(Profile, ComparesThePresetsWithSmallerSteps) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  int calls = 0;
  // Until the pull of the script of `small` is under way.
  const SceneProfile profile = ProfileScene(data.View(), {.seconds = 2.5, .most_threads = 2, .reference_threads = 2},
                                            [&](std::string_view, double) { ++calls; });
  ASSERT_EQ(profile.presets.size(), 3u);
  EXPECT_GT(calls, 50);
  EXPECT_NEAR(profile.period_ms, 10, 1e-6);
  for (const PresetFigures& figures : profile.presets) {
    EXPECT_GT(figures.step_p50_ms, 0);
    EXPECT_GE(figures.step_p99_ms, figures.step_p50_ms);
    EXPECT_GT(figures.position_error, 0);
    EXPECT_LT(figures.position_error, 0.1) << NameOf(figures.preset);
    EXPECT_LT(figures.force_error, 0.3) << NameOf(figures.preset);
    EXPECT_LT(figures.deepest_mm, 0.5);
    for (std::size_t i = 0; i < kStages; ++i) {
      EXPECT_GE(figures.stage_ms[i], 0) << NameOf(static_cast<Stage>(i));
    }
    EXPECT_GT(figures.stage_ms[static_cast<std::size_t>(Stage::kSolve)], 0);
  }
  EXPECT_LT(profile.presets[2].position_error, profile.presets[0].position_error) << "accurate against fast";
  ASSERT_EQ(profile.threads.size(), 2u);
  EXPECT_EQ(profile.threads[1].threads, 2);
}

TEST(Forecast, TellsWorkFromAllTissueInMotion) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const Forecast forecast = ForecastScene(data.View());
  EXPECT_NEAR(forecast.period_ms, 10, 1e-6);
  EXPECT_GT(forecast.all_ms, 0);
  EXPECT_GT(forecast.working_ms, 0);
  EXPECT_GT(forecast.working_awake, 0) << "the tools have reached the tissue";
  scene::SceneData without = scene::BuildProcedural(scene::Small());
  without.script.clear();
  EXPECT_EQ(ForecastScene(without.View()).working_ms, 0);
}

TEST(Profile, RefusesASceneThatHasNoPresetsOrNoScript) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  const auto none = [](std::string_view, double) {};
  data.fixed.physics.mode = PhysicsMode::kPaper;
  EXPECT_THROW((void)ProfileScene(data.View(), {}, none), InputError);
  data.fixed.physics.mode = PhysicsMode::kAccurate;
  data.script.clear();
  EXPECT_THROW((void)ProfileScene(data.View(), {}, none), InputError);
}

SceneProfile Measured(double fast_ms, double default_ms, double accurate_ms) {
  SceneProfile profile;
  profile.period_ms = 10;
  for (const auto& [preset, ms] : {std::pair{PhysicsPreset::kFast, fast_ms},
                                   {PhysicsPreset::kDefault, default_ms},
                                   {PhysicsPreset::kAccurate, accurate_ms}}) {
    profile.presets.emplace_back();
    profile.presets.back().preset = preset;
    profile.presets.back().step_p99_ms = ms;
  }
  profile.threads = {{1, 0, default_ms}};
  return profile;
}

TEST(Advice, IsTheMostAccuratePresetThatIsInTime) {
  const Advice advice = AdviceOf(Measured(2, 4, 8));  // 3.4, 6.8 and 13.6 ms in a session.
  EXPECT_TRUE(advice.in_time);
  EXPECT_EQ(advice.preset, PhysicsPreset::kDefault);
  EXPECT_EQ(advice.threads, 1);
  EXPECT_DOUBLE_EQ(advice.forecast_p99_ms, 4 * kSessionOverAlone);
  EXPECT_EQ(AdviceOf(Measured(1, 2, 4)).preset, PhysicsPreset::kAccurate);
}

TEST(Advice, SaysWhenNothingIsInTime) {
  const Advice advice = AdviceOf(Measured(20, 30, 40));
  EXPECT_FALSE(advice.in_time);
  EXPECT_EQ(advice.preset, PhysicsPreset::kFast);
}

TEST(Advice, TakesThreadsThatEarnTheirKeep) {
  SceneProfile profile = Measured(2, 4, 8);
  profile.threads.push_back({2, 0, 3.8});
  EXPECT_EQ(AdviceOf(profile).threads, 1);
  profile.threads.push_back({4, 0, 2});
  EXPECT_EQ(AdviceOf(profile).threads, 4);
  EXPECT_EQ(AdviceOf(profile).preset, PhysicsPreset::kAccurate);
}

}  // namespace
}  // namespace fulcrum::physics
