#include "services/base/core/pad_hands.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace fulcrum {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr float kTolerance_m = 1e-6f;

HandsView View() {
  HandsView view;
  view.eye = {0, -0.1f, 0};
  view.present[0] = view.present[1] = true;
  view.tip[0] = Vec3f(-0.02f, 0, 0);
  view.tip[1] = Vec3f(0.02f, 0, 0);
  return view;
}

/// A gamepad at a window whose picture looks along y with z up.
class PadHandsTest : public testing::Test {
 protected:
  PadHandsTest() {
    hands_.SetView(View());
    state_.device = 7;
    Update();  // Finds the device.
  }
  PadHands::Outcome Update(int by_ms = 2) {
    now_ns_ += by_ms * kMs;
    return pad_.Update(&state_, now_ns_, &hands_);
  }
  void Take() {
    hands_.Take(now_ns_);
    Update(0);
  }
  void Set(PadButton button, bool down) {
    const std::uint32_t bit = 1u << static_cast<unsigned>(button);
    state_.buttons = down ? state_.buttons | bit : state_.buttons & ~bit;
  }
  float& axis(PadAxis axis) { return state_.axes[static_cast<std::size_t>(axis)]; }
  Vec3f Tip(int tool = 1) { return hands_.At(now_ns_).tools[static_cast<std::size_t>(tool)].p_WT; }

  MouseHands hands_{OperatorSource::kWindow};
  PadHands pad_{PadSettings()};
  PadState state_;
  std::int64_t now_ns_ = 1000 * kMs;
};

TEST_F(PadHandsTest, ADeflectionIsAVelocityOfTheTip) {
  Take();
  axis(PadAxis::kLeftX) = 1;
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(Update().changed);
  // 100 ms at 60 mm/s.
  EXPECT_LT((Tip() - Vec3f(0.026f, 0, 0)).norm(), kTolerance_m);
  EXPECT_EQ(Tip(0), View().tip[0]) << "the other tool keeps its place";
  axis(PadAxis::kLeftX) = 0;
  axis(PadAxis::kLeftY) = -1;
  for (int i = 0; i < 50; ++i) Update();
  EXPECT_LT((Tip() - Vec3f(0.026f, 0, -0.006f)).norm(), kTolerance_m) << "down in the picture";
  axis(PadAxis::kLeftY) = 0;
  axis(PadAxis::kRightY) = 1;
  for (int i = 0; i < 50; ++i) Update();
  EXPECT_LT((Tip() - Vec3f(0.026f, 0.006f, -0.006f)).norm(), kTolerance_m) << "away from the operator";
}

TEST_F(PadHandsTest, AStickThatIsLetGoOrNearlySoMovesNothing) {
  Take();
  axis(PadAxis::kLeftX) = 0.08f;
  axis(PadAxis::kLeftY) = -0.08f;
  axis(PadAxis::kRightY) = 0.11f;
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(Update().changed);
  EXPECT_EQ(Tip(), View().tip[1]);
}

TEST_F(PadHandsTest, AStandstillOfTheProcessIsNoJump) {
  Take();
  axis(PadAxis::kLeftX) = 1;
  Update(10'000);
  EXPECT_LT((Tip() - View().tip[1]).norm(), 0.0031f);
}

TEST_F(PadHandsTest, NothingMovesUntilTheControlsAreTaken) {
  axis(PadAxis::kLeftX) = 1;
  Set(PadButton::kRightTrigger, true);
  EXPECT_FALSE(Update().changed);
  Set(PadButton::kStart, true);
  EXPECT_TRUE(Update().take);
  Take();
  EXPECT_EQ(hands_.At(now_ns_).pedals, kPedalNone) << "held since before: a pedal must be pressed anew";
  Set(PadButton::kRightTrigger, false);
  EXPECT_FALSE(Update(0).changed);
  Set(PadButton::kRightTrigger, true);
  EXPECT_TRUE(Update().changed);
  EXPECT_EQ(hands_.At(now_ns_).pedals, kPedalCut);
  Set(PadButton::kBack, true);
  EXPECT_TRUE(Update().release);
}

TEST_F(PadHandsTest, ButtonsAreThoseOfThePage) {
  Take();
  Set(PadButton::kA, true);
  Update();
  EXPECT_EQ(hands_.At(now_ns_).tools[1].jaw_angle_rad, 0);
  Set(PadButton::kA, false);
  Update();
  EXPECT_GT(hands_.At(now_ns_).tools[1].jaw_angle_rad, 0.5f);
  Set(PadButton::kLeftTrigger, true);
  Update();
  EXPECT_EQ(hands_.At(now_ns_).pedals, kPedalCoag);
  Set(PadButton::kLeftTrigger, false);
  Set(PadButton::kLeftShoulder, true);
  Update();
  EXPECT_EQ(hands_.At(now_ns_).pedals, kPedalNone);
  EXPECT_EQ(hands_.tool(), 0);
  Set(PadButton::kB, true);
  Set(PadButton::kY, true);
  Update();
  EXPECT_TRUE(hands_.locked(0));
  EXPECT_TRUE(hands_.steady());
  Set(PadButton::kRightShoulder, true);
  Update();
  EXPECT_EQ(hands_.tool(), 1);
}

TEST_F(PadHandsTest, FineAndClutchChangeTheMotion) {
  Take();
  axis(PadAxis::kLeftX) = 1;
  Set(PadButton::kX, true);
  for (int i = 0; i < 50; ++i) Update();
  EXPECT_LT((Tip() - Vec3f(0.0215f, 0, 0)).norm(), kTolerance_m);
  Set(PadButton::kX, false);
  Set(PadButton::kLeftStick, true);
  for (int i = 0; i < 50; ++i) Update();
  EXPECT_LT((Tip() - Vec3f(0.0215f, 0, 0)).norm(), kTolerance_m);
}

TEST_F(PadHandsTest, ADeviceThatOperatesAndIsUnpluggedGivesUpTheControls) {
  Take();
  Set(PadButton::kRightTrigger, true);
  Update();
  EXPECT_TRUE(pad_.Update(nullptr, now_ns_, &hands_).release);
}

TEST_F(PadHandsTest, ADeviceThatTookTheControlsAndIsUnpluggedGivesThemUp) {
  Set(PadButton::kStart, true);
  EXPECT_TRUE(Update().take);
  hands_.Take(now_ns_);
  EXPECT_TRUE(pad_.Update(nullptr, now_ns_, &hands_).release);
}

TEST_F(PadHandsTest, ADeviceThatDoesNotOperateMayBeUnplugged) {
  Take();
  EXPECT_FALSE(pad_.Update(nullptr, now_ns_, &hands_).release) << "the mouse operates";
}

TEST_F(PadHandsTest, AnotherDeviceInItsPlaceIsALossToo) {
  Take();
  Set(PadButton::kRightTrigger, true);
  Update();
  state_.device = 8;
  EXPECT_TRUE(Update().release);
  hands_.Release();
  EXPECT_FALSE(Update().release);
  Take();
  EXPECT_EQ(hands_.At(now_ns_).pedals, kPedalNone) << "its button was down already";
}

TEST_F(PadHandsTest, ASpaceMouseMovesInThreeDirections) {
  PadHands space_mouse(PadSettings::OfSpaceMouse());
  space_mouse.Update(&state_, now_ns_, &hands_);
  Take();
  axis(PadAxis::kZ) = -1;
  Set(PadButton::kFirst, true);
  for (int i = 0; i < 50; ++i) {
    now_ns_ += 2 * kMs;
    space_mouse.Update(&state_, now_ns_, &hands_);
  }
  EXPECT_LT((Tip() - Vec3f(0.02f, -0.006f, 0)).norm(), kTolerance_m);
  EXPECT_EQ(hands_.At(now_ns_).tools[1].jaw_angle_rad, 0);
}

TEST(PadVelocity, KeepsTheDirectionOfTheStickAndIsFineNearTheMiddle) {
  const PadSettings settings;
  const Vec3f slow = PadVelocity(settings, {0.4f, 0.2f, 0});
  EXPECT_NEAR(slow.y() / slow.x(), 0.5f, 1e-5f);
  // (0.4472 - 0.12) / 0.88 = 0.3718, cubed 0.0514.
  EXPECT_NEAR(slow.norm(), 0.06f * 0.0514f, 1e-5f);
  EXPECT_NEAR(PadVelocity(settings, {1, 1, 0}).norm(), 0.06f, 1e-6f) << "no faster in a corner";
  EXPECT_EQ(PadVelocity(settings, {0, 0, -1}).z(), -0.06f);
}

TEST(PadVelocity, AnAxisCanBeInvertedOrWithoutEffect) {
  PadSettings settings;
  settings.motion = {PadDirection{PadAxis::kLeftX, -1}, std::nullopt, std::nullopt};
  PadHands pad(settings);
  MouseHands hands(OperatorSource::kWindow);
  hands.SetView(View());
  hands.Take(1);
  PadState state;
  state.device = 1;
  state.axes.fill(1);
  pad.Update(&state, kMs, &hands);
  pad.Update(&state, 11 * kMs, &hands);
  EXPECT_LT((hands.At(11 * kMs).tools[1].p_WT - Vec3f(0.0194f, 0, 0)).norm(), kTolerance_m);
}

TEST(PadRumble, BeginsAboveAForceAndGrowsWithIt) {
  const PadSettings settings;
  EXPECT_EQ(PadRumble(settings, 0.4f), 0);
  EXPECT_NEAR(PadRumble(settings, 1.9f), 0.5f, 1e-6f);
  EXPECT_EQ(PadRumble(settings, 50), 1);
}

TEST(PadNames, AreAllDifferent) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < kPadActions; ++i) names.insert(PadActionName(static_cast<PadAction>(i)));
  EXPECT_EQ(names.size(), kPadActions);
  names.clear();
  for (std::size_t i = 0; i < kPadButtons; ++i) names.insert(PadButtonName(static_cast<PadButton>(i)));
  EXPECT_EQ(names.size(), kPadButtons);
  names.clear();
  for (std::size_t i = 0; i < kPadAxes; ++i) names.insert(PadAxisName(static_cast<PadAxis>(i)));
  EXPECT_EQ(names.size(), kPadAxes);
}

}  // namespace
}  // namespace fulcrum
