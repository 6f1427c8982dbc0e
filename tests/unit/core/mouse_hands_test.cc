#include "services/base/core/mouse_hands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace fulcrum {
namespace {

constexpr std::int64_t kMs = 1'000'000;

HandsView View() {
  HandsView view;
  view.eye = {0, -0.1f, 0};
  view.pixel = 1e-3f;
  view.present = {true, true};
  view.tip[0] = {-0.02f, 0, 0};
  view.tip[1] = {0.02f, 0, 0};
  return view;
}

class MouseHandsTest : public testing::Test {
 protected:
  MouseHandsTest() { hands_.SetView(View()); }
  MouseHands hands_{OperatorSource::kWindow};
};

TEST_F(MouseHandsTest, DoesNothingUntilTaken) {
  hands_.Move(10, 10);
  hands_.Press(HandsKey::kCut, true);
  const OperatorInput input = hands_.At(5 * kMs);
  EXPECT_EQ(input.claim_ns, 0);
  EXPECT_EQ(input.pedals, kPedalNone);
  EXPECT_FALSE(input.tools[1].moves);
}

TEST_F(MouseHandsTest, BeginsWhereTheToolsAreAndStaysUnderThePointer) {
  hands_.Take(5 * kMs);
  OperatorInput input = hands_.At(6 * kMs);
  EXPECT_EQ(input.claim_ns, 5 * kMs);
  EXPECT_EQ(input.tools[0].p_WT, View().tip[0]);
  EXPECT_EQ(input.tools[1].p_WT, View().tip[1]);
  // The tip is 100 mm from the eye, where a pixel is 0.1 mm.
  hands_.Move(30, -20);
  input = hands_.At(7 * kMs);
  EXPECT_LT((input.tools[1].p_WT - Vec3f(0.023f, 0, -0.002f)).norm(), 1e-6f);
  EXPECT_EQ(input.tools[0].p_WT, View().tip[0]) << "the other tool keeps its place";
  hands_.Turn(2);
  EXPECT_LT((hands_.At(8 * kMs).tools[1].p_WT - Vec3f(0.023f, 0.002f, -0.002f)).norm(), 1e-6f);
}

TEST_F(MouseHandsTest, ModifiersChangeTheMotion) {
  hands_.Take(5 * kMs);
  hands_.Press(HandsKey::kFine, true);
  hands_.Move(40, 0);
  hands_.Press(HandsKey::kFine, false);
  EXPECT_LT((hands_.At(6 * kMs).tools[1].p_WT - Vec3f(0.021f, 0, 0)).norm(), 1e-6f);
  hands_.Press(HandsKey::kDepth, true);
  hands_.Move(0, 30);
  hands_.Press(HandsKey::kDepth, false);
  EXPECT_LT((hands_.At(7 * kMs).tools[1].p_WT - Vec3f(0.021f, 0.003f, 0)).norm(), 1e-6f);
  hands_.Press(HandsKey::kClutch, true);
  hands_.Move(100, 100);
  hands_.Press(HandsKey::kClutch, false);
  EXPECT_LT((hands_.At(8 * kMs).tools[1].p_WT - Vec3f(0.021f, 0.003f, 0)).norm(), 1e-6f);
}

TEST_F(MouseHandsTest, TheIntentionLeadsTheToolByAtMostFourCentimetres) {
  hands_.Take(5 * kMs);
  for (int i = 0; i < 100; ++i) hands_.Move(100, 0);
  EXPECT_NEAR((hands_.At(6 * kMs).tools[1].p_WT - View().tip[1]).norm(), 0.04f, 1e-6f);
}

TEST_F(MouseHandsTest, JawsPedalsAndTools) {
  hands_.Take(5 * kMs);
  hands_.Press(HandsKey::kTool0, true);
  EXPECT_EQ(hands_.tool(), 0);
  hands_.Press(HandsKey::kJaw, true);
  EXPECT_EQ(hands_.At(6 * kMs).tools[0].jaw_angle_rad, 0);
  EXPECT_GT(hands_.At(6 * kMs).tools[1].jaw_angle_rad, 0.5f);
  hands_.Press(HandsKey::kTool1, true);
  EXPECT_GT(hands_.At(7 * kMs).tools[1].jaw_angle_rad, 0.5f) << "the button is down for the tool before";
  hands_.Press(HandsKey::kJaw, false);
  EXPECT_EQ(hands_.At(7 * kMs).tools[0].jaw_angle_rad, 0) << "what it holds is kept";
  hands_.Press(HandsKey::kCut, true);
  EXPECT_EQ(hands_.At(8 * kMs).pedals, kPedalCut);
  hands_.Press(HandsKey::kCoag, true);
  hands_.Press(HandsKey::kCut, false);
  EXPECT_EQ(hands_.At(9 * kMs).pedals, kPedalCoag);
  hands_.Press(HandsKey::kTool0, true);
  hands_.Press(HandsKey::kJawLock, true);
  EXPECT_GT(hands_.At(10 * kMs).tools[0].jaw_angle_rad, 0.5f);
  hands_.Release();
  EXPECT_EQ(hands_.At(11 * kMs).pedals, kPedalNone);
  EXPECT_EQ(hands_.At(11 * kMs).claim_ns, 0);
}

TEST_F(MouseHandsTest, SteadyFollowsSlowMotionAndDampsTremor) {
  hands_.Take(1);
  hands_.Press(HandsKey::kSteady, true);
  float largest = 0;
  // Tremor of 10 Hz and 1 mm, sampled each millisecond.
  float before = 0;
  for (int ms = 1; ms <= 1000; ++ms) {
    const float now = 10.0f * std::sin(6.2831853f * 0.01f * static_cast<float>(ms));
    hands_.Move(now - before, 0);
    before = now;
    const float x = hands_.At(ms * kMs).tools[1].p_WT.x() - 0.02f;
    if (ms > 500) largest = std::max(largest, std::abs(x));
  }
  EXPECT_LT(largest, 0.3e-3f);
  EXPECT_GT(largest, 0.1e-3f);
}

TEST_F(MouseHandsTest, ControlsTakenBeforeTheToolsAreKnownMoveNothing) {
  MouseHands hands(OperatorSource::kWindow);
  hands.Take(5 * kMs);
  EXPECT_FALSE(hands.At(6 * kMs).tools[1].moves);
  hands.SetView(View());
  const OperatorInput input = hands.At(7 * kMs);
  for (std::size_t i = 0; i < kMaxTools; ++i) EXPECT_EQ(input.tools[i].p_WT, View().tip[i]) << "not the origin of W";
}

TEST_F(MouseHandsTest, WhoTakesThemFindsTheToolsTurnedAsTheyAre) {
  hands_.Take(5 * kMs);
  hands_.Roll(2);
  hands_.Release();
  HandsView view = View();
  view.roll_rad = {-0.3f, 0.5f};
  hands_.SetView(view);
  hands_.Take(6 * kMs);
  const OperatorInput input = hands_.At(7 * kMs);
  EXPECT_EQ(input.tools[0].roll_rad, -0.3f);
  EXPECT_EQ(input.tools[1].roll_rad, 0.5f) << "not the 2 of the last person";
  // Newer rolls of the tools do not turn what is held.
  view.roll_rad = {};
  hands_.SetView(view);
  EXPECT_EQ(hands_.At(8 * kMs).tools[1].roll_rad, 0.5f);
}

TEST_F(MouseHandsTest, WhoTakesThemFindsTheJawsAsTheyAre) {
  HandsView view = View();
  view.present[2] = view.scope[2] = true;
  view.tip[2] = view.eye;
  hands_.SetView(view);
  hands_.Take(5 * kMs);
  hands_.Press(HandsKey::kTool0, true);
  hands_.Press(HandsKey::kJawLock, true);
  hands_.Press(HandsKey::kTool2, true);
  hands_.Press(HandsKey::kJawLock, true);
  hands_.Release();
  // The angles that the picture shows, from any source.
  view.closed = {true, false, true};
  hands_.SetView(view);
  hands_.Take(6 * kMs);
  OperatorInput input = hands_.At(7 * kMs);
  EXPECT_EQ(input.tools[0].jaw_angle_rad, 0) << "what it holds does not fall";
  EXPECT_GT(input.tools[1].jaw_angle_rad, 0.5f);
  EXPECT_NEAR(input.tools[2].jaw_angle_rad, 1.0472f, 1e-4f) << "still zoomed";
  hands_.Press(HandsKey::kTool0, true);
  EXPECT_TRUE(hands_.locked(0));
  hands_.Press(HandsKey::kJawLock, true);
  EXPECT_GT(hands_.At(8 * kMs).tools[0].jaw_angle_rad, 0.5f);
  // Another source has opened it meanwhile.
  view.closed = {};
  hands_.Release();
  hands_.SetView(view);
  hands_.Take(9 * kMs);
  EXPECT_GT(hands_.At(10 * kMs).tools[0].jaw_angle_rad, 0.5f);
  EXPECT_EQ(hands_.At(10 * kMs).tools[2].jaw_angle_rad, 0) << "wide";
}

TEST_F(MouseHandsTest, AScopeTurnsWithThePointerRollsAndZooms) {
  HandsView view = View();
  view.present[2] = view.scope[2] = true;
  view.tip[2] = view.eye;
  hands_.SetView(view);
  hands_.Take(5 * kMs);
  hands_.Press(HandsKey::kTool3, true);
  EXPECT_EQ(hands_.tool(), 1) << "the session has no fourth tool";
  hands_.Press(HandsKey::kTool2, true);
  EXPECT_EQ(hands_.tool(), 2);
  hands_.Move(10, 0);
  hands_.Press(HandsKey::kRollRight, true);
  hands_.Roll(0.1f);
  OperatorInput input = hands_.At(6 * kMs);
  // The picture turns by the angle of ten pixels about a pivot 120 mm behind the lens.
  EXPECT_LT((input.tools[2].p_WT - (view.eye + Vec3f(10 * 1e-3f * 0.12f, 0, 0))).norm(), 1e-6f);
  EXPECT_NEAR(input.tools[2].roll_rad, 0.1f + 0.0872665f, 1e-5f);
  EXPECT_EQ(input.tools[2].jaw_angle_rad, 0) << "wide";
  EXPECT_EQ(input.tools[1].roll_rad, 0);
  hands_.Press(HandsKey::kJawLock, true);
  EXPECT_NEAR(hands_.At(7 * kMs).tools[2].jaw_angle_rad, 1.0472f, 1e-4f) << "zoomed";
  hands_.Roll(1000);
  EXPECT_LE(hands_.At(8 * kMs).tools[2].roll_rad, 6.2832f);
}

}  // namespace
}  // namespace fulcrum
