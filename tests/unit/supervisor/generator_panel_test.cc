#include "services/session/supervisor/generator_panel.h"

#include <gtest/gtest.h>
#include <time.h>

#include <string>
#include <vector>

#include "services/base/core/error.h"

namespace fulcrum::supervisor {
namespace {

ScriptKey Key(float time_s, std::uint32_t tool, std::uint32_t pedals, float power_W) {
  ScriptKey key{};
  key.time_s = time_s;
  key.tool = tool;
  key.pedals = pedals;
  key.power_W = power_W;
  return key;
}

class Panel : public testing::Test {
 protected:
  /// Cut from 2 to 4 s at 30 W and from 6 to 8 s at 50 W, coag from 9 s on at 20 W.
  const std::vector<ScriptKey> script_ = {Key(0, 0, 0, 0),          Key(0, 1, 0, 0),          Key(2, 1, kPedalCut, 30),
                                          Key(4, 1, 0, 0),          Key(6, 1, kPedalCut, 50), Key(8, 1, 0, 0),
                                          Key(9, 1, kPedalCoag, 20)};
  const config::GeneratorConfig cart_{.cut_W = 35, .coag_W = 36, .blend_W = 37};
};

TEST_F(Panel, IsSetAsTheCartSaysWhereNobodyFollowsTheScript) {
  GeneratorPanel panel(cart_, {});
  EXPECT_FALSE(panel.Follow(7));
  EXPECT_EQ(panel.setting().cut_W, 35);
  EXPECT_EQ(panel.setting().coag_W, 36);
  EXPECT_EQ(panel.setting().blend_W, 37);
}

TEST_F(Panel, ASimulatedOperatorSetsItAheadOfEachUse) {
  GeneratorPanel panel(cart_, script_);
  EXPECT_EQ(panel.setting().cut_W, 30) << "before the session begins";
  EXPECT_EQ(panel.setting().coag_W, 20);
  EXPECT_EQ(panel.setting().blend_W, 37) << "the script does not set it";
  EXPECT_FALSE(panel.Follow(3.9));
  EXPECT_TRUE(panel.Follow(4.02));
  EXPECT_EQ(panel.turned_s(), 4);
  EXPECT_EQ(panel.setting().cut_W, 50);
  EXPECT_FALSE(panel.Follow(20));
  EXPECT_EQ(panel.setting().cut_W, 50);
}

TEST_F(Panel, WhatOthersTurnStaysUntilTheScriptTurnsThatKnob) {
  GeneratorPanel panel(cart_, script_);
  panel.Turn("cut=40 blend=10.5");
  EXPECT_FALSE(panel.Follow(3));
  EXPECT_EQ(panel.setting().cut_W, 40);
  EXPECT_TRUE(panel.Follow(5));
  EXPECT_EQ(panel.setting().cut_W, 50);
  EXPECT_EQ(panel.setting().blend_W, 10.5f);
  EXPECT_EQ(panel.Text(), "cut 50 W, coag 20 W, blend 10.5 W");
}

/// `uses` cuts of a second, every two seconds, by tool 1; each at another power.
std::vector<ScriptKey> ManyUses(int uses) {
  std::vector<ScriptKey> script{Key(0, 0, 0, 0)};
  for (int i = 0; i < uses; ++i) {
    const auto begin_s = static_cast<float>(2 * i + 1);
    script.push_back(Key(begin_s, 1, kPedalCut, static_cast<float>(20 + i % 7)));
    script.push_back(Key(begin_s + 1, 1, 0, 0));
  }
  return script;
}

TEST_F(Panel, TwoToolsUseAKnobInTheOrderOfTime) {
  const std::vector<ScriptKey> script = {Key(1, 0, kPedalCut, 20), Key(9, 0, 0, 0), Key(2, 1, kPedalCut, 30),
                                         Key(3, 1, 0, 0), Key(12, 1, kPedalCut, 40)};
  GeneratorPanel panel(cart_, script);
  EXPECT_EQ(panel.setting().cut_W, 20);
  EXPECT_FALSE(panel.Follow(8.9)) << "the first use goes on";
  EXPECT_TRUE(panel.Follow(9.01));
  EXPECT_EQ(panel.setting().cut_W, 40);
  EXPECT_EQ(panel.turned_s(), 9) << "not the time of the use that the other tool has ended before";
}

TEST_F(Panel, ATurnCostsTheSameHoweverLongTheScriptIs) {
  const auto seconds = [&](const std::vector<ScriptKey>& script) {
    GeneratorPanel panel(cart_, script);
    const auto now = [] {
      timespec t{};
      ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
      return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    };
    const double begin = now();
    int turns = 0;
    for (int i = 0; i < 20000; ++i) turns += panel.Follow(0.02 * i) ? 1 : 0;
    EXPECT_GT(turns, 100);
    return now() - begin;
  };
  const std::vector<ScriptKey> one = ManyUses(300), many = ManyUses(180000);
  (void)seconds(one);
  EXPECT_LT(seconds(many), 20 * seconds(one)) << "600 times as many keys";
}

TEST_F(Panel, WhatIsNoSettingIsRefusedAndTurnsNothing) {
  GeneratorPanel panel(cart_, {});
  for (const char* words : {"cut", "cut=", "cut=x", "cut=-1", "cut=301", "cut=nan", "cut=inf", "cut=4O", "burn=40",
                            "=40", "coag=20 cut=9999", "cut=40W"}) {
    try {
      panel.Turn(words);
      ADD_FAILURE() << words;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("0 to 300 W"), std::string::npos) << error.what();
    }
  }
  EXPECT_EQ(panel.Text(), "cut 35 W, coag 36 W, blend 37 W");
  panel.Turn("");
  EXPECT_EQ(panel.Text(), "cut 35 W, coag 36 W, blend 37 W");
}

}  // namespace
}  // namespace fulcrum::supervisor
