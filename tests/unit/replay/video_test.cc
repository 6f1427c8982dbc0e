// What a video of a session shows and when: chapters, and the pace at which it can be drawn.
#include "services/apps/replayer/video.h"

#include <gtest/gtest.h>

#include <cmath>

namespace fulcrum::replay {
namespace {

class ChaptersTest : public ::testing::Test {
 protected:
  ChaptersTest() {
    generator_.cut_W = 35.2f;
    generator_.coag_W = 30;
  }
  void Pedals(double begin_s, double end_s, std::uint8_t pedals) {
    handles_.pedals = pedals;
    for (double time_s = begin_s; time_s <= end_s; time_s += 0.01) Follow(time_s);
    handles_.pedals = kPedalNone;
    Follow(end_s);
  }
  void Event(double time_s, ThermalEventKind kind) {
    ++event_.stamp.sequence;
    event_.kind = kind;
    Follow(time_s);
  }
  void Follow(double time_s) { chapters_.Follow(time_s, handles_, generator_, event_); }
  void ExpectChapters(const std::vector<Chapter>& wanted) {
    ASSERT_EQ(chapters_.list().size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      EXPECT_NEAR(chapters_.list()[i].begin_s, wanted[i].begin_s, 1e-9) << i;
      EXPECT_EQ(chapters_.list()[i].title, wanted[i].title) << i;
    }
  }

  HandleState handles_;
  GeneratorSetting generator_;
  ThermalEvent event_;
  Chapters chapters_;
};

TEST_F(ChaptersTest, BeginWhenTheGeneratorIsUsed) {
  Pedals(0, 1, kPedalNone);
  Pedals(1, 3, kPedalCut);
  Pedals(4, 5, kPedalCut);  // A second later: the same stroke to a viewer.
  Pedals(9, 10, kPedalCut);
  Pedals(10.5, 11, kPedalCoag);
  ExpectChapters({{0, "start"}, {1, "cut at 35 W"}, {9, "cut at 35 W"}, {10.5, "coagulation at 30 W"}});
}

TEST_F(ChaptersTest, APedalWithoutPowerIsNone) {
  generator_ = {};
  Pedals(1, 2, kPedalCut);
  ExpectChapters({{0, "start"}});
}

TEST_F(ChaptersTest, BeginWithAWarningAndWithAnInjury) {
  Event(1, ThermalEventKind::kSteam);
  for (double time_s = 2; time_s < 6; time_s += 1) Event(time_s, ThermalEventKind::kUreterWarning);
  Event(6.5, ThermalEventKind::kUreterInjury);
  Follow(12);  // The newest event again is no new event.
  Event(13, ThermalEventKind::kNerveWarning);
  ExpectChapters({{0, "start"}, {2, "heat near the ureter"}, {6.5, "ureter injured"}, {13, "heat near the nerve"}});
}

TEST(PeriodToFinish, IsThatOfTheVideoWhileThereIsTime) {
  EXPECT_DOUBLE_EQ(PeriodToFinish({.used_s = 2, .reading_s = 0.4, .looks = 60, .at_s = 2, .end_s = 20}, 60), 1.0 / 30);
}

TEST(PeriodToFinish, GrowsUntilTheRestFits) {
  // Five minutes of a session, of which a second takes 0.05 s to read and 30 * 0.03 s to draw; a minute is left.
  const VideoWork work{.used_s = 9.5, .reading_s = 0.5, .looks = 300, .at_s = 10, .end_s = 310};
  const double period_s = PeriodToFinish(work, 69.5);
  EXPECT_NEAR(300 * 0.05 + 300 / period_s * 0.03, 60, 1e-9);
}

TEST(PeriodToFinish, IsInfiniteWhenReadingAloneTakesLonger) {
  EXPECT_TRUE(std::isinf(PeriodToFinish({.used_s = 5, .reading_s = 4, .looks = 30, .at_s = 10, .end_s = 1000}, 60)));
}

TEST(PeriodToFinish, IsThatOfTheVideoAtItsBeginAndEnd) {
  EXPECT_DOUBLE_EQ(PeriodToFinish({}, 60), 1.0 / 30);
  EXPECT_DOUBLE_EQ(PeriodToFinish({.used_s = 70, .reading_s = 1, .looks = 9, .at_s = 20, .end_s = 20}, 60), 1.0 / 30);
}

}  // namespace
}  // namespace fulcrum::replay
