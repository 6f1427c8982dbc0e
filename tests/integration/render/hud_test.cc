#include "render_node/node/hud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace fulcrum::render {
namespace {

bool Says(const HudState& state, const std::string& text) {
  const auto texts = HudTexts(state, false);
  return std::any_of(texts.begin(), texts.end(), [&](const OverlayText& line) { return line.text == text; });
}

TEST(Hud, NamesTheGamepadsButtonsAsTheCartAssignsThemWhileOneIsPluggedIn) {
  HudState state;
  state.help = true;
  state.hands = HandsState();
  EXPECT_TRUE(Says(state, "CLICK OR ENTER: TAKE THE TOOLS"));
  EXPECT_FALSE(Says(state, "RIGHT TRIGGER: CUT"));
  state.hands->gamepad = true;
  EXPECT_TRUE(Says(state, "CLICK, ENTER OR START: TAKE THE TOOLS"));
  EXPECT_TRUE(Says(state, "RIGHT TRIGGER: CUT"));
  EXPECT_TRUE(Says(state, "RIGHT Y: DEEPER"));
  state.gamepad.motion[1] = PadDirection{PadAxis::kLeftY, -1};
  state.gamepad.buttons[static_cast<std::size_t>(PadAction::kTake)] = std::nullopt;
  EXPECT_TRUE(Says(state, "-LEFT Y: UP"));
  EXPECT_TRUE(Says(state, "CLICK OR ENTER: TAKE THE TOOLS"));
}

TEST(Hud, SaysWhatATubeDoesAndHow) {
  HudState state;
  state.force_N[1] = 0.0f;
  state.flow[1] = TubeFlow::kIrrigates;
  const auto texts = HudTexts(state, true);
  EXPECT_TRUE(std::ranges::any_of(texts, [](const OverlayText& line) { return line.text.ends_with(" IRRIGATION"); }));
  state.help = true;
  state.hands = HandsState();
  EXPECT_FALSE(Says(state, "TUBE: HOLD THE JAW: SUCTION"));
  state.tube = true;
  EXPECT_TRUE(Says(state, "TUBE: HOLD THE JAW: SUCTION"));
}

TEST(Hud, NamesTheModeThatTheGeneratorDeliversWithSeveralPedalsDown) {
  HudState state;
  state.power_W = 60;
  const auto says = [&](std::uint8_t pedals, const std::string& text) {
    state.pedals = pedals;
    return std::ranges::any_of(HudTexts(state, true), [&](const OverlayText& line) { return line.text == text; });
  };
  EXPECT_TRUE(says(kPedalCut | kPedalBlend, "CUT 60 W"));
  EXPECT_TRUE(says(kPedalCoag | kPedalBlend, "BLEND 60 W"));
  EXPECT_TRUE(says(kPedalCoag, "COAG 60 W"));
}

TEST(Hud, TheBarIsFullAtTheHighestForceAllowedAndAWarningAbove) {
  HudState state;
  state.force_limit_N = 4;
  state.force_N[0] = 4.0f;
  state.force_N[1] = 7.66f;
  const std::vector<OverlayText> texts = HudTexts(state, true);
  const auto bar = [&](const std::string& text) {
    return std::find_if(texts.begin(), texts.end(), [&](const OverlayText& t) { return t.text == text; });
  };
  ASSERT_NE(bar("L ▮▮▮▮▮▮▮▮▮▮ 4.0 N"), texts.end());
  EXPECT_FALSE(bar("L ▮▮▮▮▮▮▮▮▮▮ 4.0 N")->warning);
  ASSERT_NE(bar("R ▮▮▮▮▮▮▮▮▮▮ 7.7 N"), texts.end());
  EXPECT_TRUE(bar("R ▮▮▮▮▮▮▮▮▮▮ 7.7 N")->warning);
  // The assistant's force is not the trainee's.
  state.assists[1] = true;
  for (const OverlayText& text : HudTexts(state, true)) EXPECT_FALSE(text.warning) << text.text;
}

}  // namespace
}  // namespace fulcrum::render
