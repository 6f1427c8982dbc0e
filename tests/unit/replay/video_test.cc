// What a video of a session shows and when: chapters, and the pace at which it can be drawn.
#include "services/apps/replayer/video.h"

#include <gtest/gtest.h>

#include <optional>

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

TEST_F(ChaptersTest, APedalBeforeTheSessionBeginsWithIt) {
  Pedals(-0.15, 1, kPedalCut);
  ExpectChapters({{0, "start"}, {0, "cut at 35 W"}});
}

TEST(PeriodToFinish, IsThatOfTheVideoWhileThereIsTime) {
  const auto period_s = PeriodToFinish({.used_s = 2, .reading_s = 0.4, .looks = 60, .at_s = 2, .end_s = 20}, 60);
  EXPECT_DOUBLE_EQ(period_s.value(), 1.0 / 30);
}

/// Time that a video takes whose pictures cost more from its middle on [s]; none: it is given up.
std::optional<double> TimeOf(double end_s, double each_s, double later_each_s, double within_s) {
  constexpr double kReading = 0.05;  // Of the session's time.
  VideoWork work{.end_s = end_s};
  for (double next_s = 0; next_s <= end_s;) {
    work.reading_s += kReading * (next_s - work.at_s);
    work.used_s += kReading * (next_s - work.at_s) + (next_s < end_s / 2 ? each_s : later_each_s);
    work.at_s = next_s;
    ++work.looks;
    const auto period_s = PeriodToFinish(work, within_s);
    if (!period_s) return std::nullopt;
    next_s += *period_s;
  }
  return work.used_s;
}

TEST(PeriodToFinish, IsReadyInTimeAlsoWhenLaterPicturesCostMore) {
  for (const double end_s : {50.0, 120.0, 300.0, 600.0}) {
    for (const double later : {1.0, 1.5}) {
      const auto time_s = TimeOf(end_s, 0.035, later * 0.035, 60);
      ASSERT_TRUE(time_s.has_value()) << end_s << " " << later;
      EXPECT_LT(*time_s, 60) << end_s << " " << later;
      EXPECT_GT(*time_s, 40) << "few pictures although there was time: " << end_s << " " << later;
    }
  }
}

TEST(PeriodToFinish, GivesUpWhenReadingAloneTakesLonger) {
  EXPECT_EQ(TimeOf(2000, 0.035, 0.035, 60), std::nullopt);
  EXPECT_EQ(PeriodToFinish({.used_s = 5, .reading_s = 4, .looks = 30, .at_s = 10, .end_s = 1000}, 60), std::nullopt);
}

TEST(PeriodToFinish, DoesNotGiveUpAtTheEnd) {
  EXPECT_TRUE(PeriodToFinish({.used_s = 70, .reading_s = 1, .looks = 9, .at_s = 20, .end_s = 20}, 60).has_value());
}

}  // namespace
}  // namespace fulcrum::replay
