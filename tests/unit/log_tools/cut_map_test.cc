// Holes with known course, length and width.
#include "services/records/log_tools/cut_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "services/records/log_tools/centre_line.h"
#include "services/records/log_tools/cut_picture.h"
#include "services/records/log_tools/mask.h"

namespace fulcrum::log_tools {
namespace {

/// Pruning and averaging are designed for texels of 0.1 mm. Thinning resolves a line to a fraction of a texel.
constexpr double kLengthTolerance = 0.03;
constexpr double kWidthTolerance = 1.0;  // [texels]

/// All texels whose centre is within `radius` of a polyline.
void Stroke(Mask* mask, const std::vector<Vec2d>& line, double radius) {
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vec2d along = line[i] - line[i - 1];
    // Pixels near the stretch alone: all of them would take minutes under sanitizers.
    const Vec2d low = line[i - 1].cwiseMin(line[i]).array() - radius - 1;
    const Vec2d high = line[i - 1].cwiseMax(line[i]).array() + radius + 1;
    for (int y = std::max(0, static_cast<int>(low.y())); y < std::min<double>(mask->height, high.y()); ++y) {
      for (int x = std::max(0, static_cast<int>(low.x())); x < std::min<double>(mask->width, high.x()); ++x) {
        const Vec2d at(x + 0.5, y + 0.5);
        const double u = std::clamp((at - line[i - 1]).dot(along) / along.squaredNorm(), 0.0, 1.0);
        if ((line[i - 1] + u * along - at).norm() <= radius) mask->Put(x, y);
      }
    }
  }
}

double LengthOf(const std::vector<Vec2d>& line) {
  double length = 0;
  for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
  return length;
}

std::vector<Vec2d> Curve(int points, const std::function<Vec2d(double)>& at) {
  std::vector<Vec2d> line;
  for (int i = 0; i <= points; ++i) line.push_back(at(static_cast<double>(i) / points));
  return line;
}

double MedianWidth(const CentreLine& line) {
  std::vector<double> widths;
  for (const auto& stretch : line.stretches) {
    for (const CentrePoint& point : stretch.points) widths.push_back(point.width);
  }
  std::sort(widths.begin(), widths.end());
  return widths.empty() ? 0 : widths[widths.size() / 2];
}

TEST(Mask, DistancesAreThoseToTheNearestClearPixel) {
  std::mt19937 random(1);
  Mask mask(23, 17);
  for (auto& pixel : mask.set) pixel = random() % 8 != 0 ? 1 : 0;
  const std::vector<float> distance = DistanceToClear(mask);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      double nearest = 1e9;
      for (int v = -1; v <= mask.height; ++v) {
        for (int u = -1; u <= mask.width; ++u) {
          if (!mask.At(u, v)) nearest = std::min(nearest, std::hypot(u - x, v - y));
        }
      }
      EXPECT_NEAR(static_cast<double>(distance[mask.Index(x, y)]), nearest, 1e-5) << x << ' ' << y;
    }
  }
}

TEST(CentreLine, BarsOfAnyDirectionAreMeasuredFromEndToEnd) {
  for (const double radius : {3.0, 6.0, 9.0}) {
    for (int degrees = 0; degrees <= 90; degrees += 15) {
      const double angle = degrees * std::numbers::pi / 180;
      const std::vector<Vec2d> line{Vec2d(150, 150) - 110 * Vec2d(std::cos(angle), std::sin(angle)),
                                    Vec2d(150, 150) + 110 * Vec2d(std::cos(angle), std::sin(angle))};
      Mask mask(300, 300);
      Stroke(&mask, line, radius);
      const CentreLine found = FindCentreLine(mask);
      EXPECT_EQ(found.stretches.size(), 1u) << degrees << " deg, radius " << radius;
      const double length = LengthOf(line) + 2 * radius;
      EXPECT_NEAR(found.length(), length, kLengthTolerance * length) << degrees << " deg, radius " << radius;
      EXPECT_NEAR(MedianWidth(found), 2 * radius, kWidthTolerance) << degrees << " deg, radius " << radius;
    }
  }
}

TEST(CentreLine, RoughEdgesAreNoBranches) {
  std::mt19937 random(7);
  Mask mask(300, 60);
  std::uniform_int_distribution<int> rough(-1, 1);
  for (int x = 20; x < 280; ++x) {
    const int low = 24 + rough(random), high = 36 + rough(random);
    for (int y = low; y < high; ++y) mask.Put(x, y);
  }
  const CentreLine found = FindCentreLine(mask);
  EXPECT_EQ(found.stretches.size(), 1u);
  EXPECT_NEAR(found.length(), 260, kLengthTolerance * 260);
  EXPECT_NEAR(MedianWidth(found), 12, 2 * kWidthTolerance);
}

TEST(CentreLine, RingIsClosed) {
  const auto circle = Curve(200, [](double u) {
    return Vec2d(100 + 70 * std::cos(2 * std::numbers::pi * u), 100 + 70 * std::sin(2 * std::numbers::pi * u));
  });
  Mask mask(200, 200);
  Stroke(&mask, circle, 5);
  const CentreLine found = FindCentreLine(mask);
  ASSERT_EQ(found.stretches.size(), 1u);
  EXPECT_TRUE(found.stretches.front().closed);
  EXPECT_NEAR(found.length(), LengthOf(circle), kLengthTolerance * LengthOf(circle));
}

TEST(CentreLine, BranchesOfATeeAreCountedOnce) {
  Mask mask(260, 200);
  Stroke(&mask, {{30, 150}, {230, 150}}, 5);
  Stroke(&mask, {{130, 150}, {130, 30}}, 5);
  const CentreLine found = FindCentreLine(mask);
  EXPECT_EQ(found.stretches.size(), 3u);
  EXPECT_NEAR(found.length(), 210 + 125, kLengthTolerance * 335);
}

TEST(CentreLine, FigureOfEightIsItsWholeCourse) {
  const auto eight = Curve(400, [](double u) {
    const double a = 2 * std::numbers::pi * u;
    return Vec2d(150 + 120 * std::sin(a), 80 + 50 * std::sin(2 * a));
  });
  Mask mask(300, 160);
  Stroke(&mask, eight, 4);
  EXPECT_NEAR(FindCentreLine(mask).length(), LengthOf(eight), kLengthTolerance * LengthOf(eight));
}

TEST(CentreLine, ZigzagKeepsItsLength) {
  std::vector<Vec2d> line;
  for (int i = 0; i <= 8; ++i) line.emplace_back(30 + 60 * i, i % 2 == 0 ? 40 : 100);
  Mask mask(560, 150);
  Stroke(&mask, line, 4);
  const double length = LengthOf(line) + 8;
  // The average rounds corners, which costs 0.2 mm at each.
  EXPECT_NEAR(FindCentreLine(mask).length(), length, 2 * kLengthTolerance * length);
}

TEST(CentreLine, SmallestHoleHasALength) {
  Mask mask(20, 20);
  mask.Put(10, 10);
  EXPECT_GT(FindCentreLine(mask).length(), 0.3);
  EXPECT_LT(FindCentreLine(mask).length(), 2.0);
  EXPECT_TRUE(FindCentreLine(Mask(20, 20)).stretches.empty());
}

// ---------------------------------------------------------------------------------------------- maps

RecordedCut SheetOf(const Mask& removed) {
  RecordedCut cut;
  cut.texels.width = removed.width;
  cut.texels.height = removed.height;
  cut.texels.removed = removed.set;
  cut.texels.damage.assign(removed.set.size(), 0);
  cut.texels.temperature.assign(removed.set.size(), 0);
  return cut;
}

/// Metal that moves from `from` to `to` in 2 s [mm].
void AddWay(RecordedCut* cut, const Vec2d& from, const Vec2d& to) {
  for (int i = 0; i <= 200; ++i) {
    MetalFrame frame;
    frame.time_s = 1 + 0.01 * i;
    frame.in_contact = true;
    frame.goes_on = i > 0;
    frame.mode = CauteryMode::kCut;
    frame.centre = (1e-3 * (from + i / 200.0 * (to - from))).cast<float>();
    frame.touched = {frame.centre};
    cut->metal.push_back(frame);
    CurrentSample sample;
    sample.time_s = frame.time_s;
    sample.touching = true;
    sample.mode = CauteryMode::kCut;
    sample.power_W = 35;
    sample.material = frame.centre;
    cut->current.push_back(sample);
  }
}

TEST(CutMap, RingAroundALivingIslandIsTold) {
  Mask mask(200, 200);
  Stroke(&mask, {{50, 100}, {150, 100}}, 8);
  // 1 mm^2 and one texel.
  for (int y = 95; y < 105; ++y) {
    for (int x = 80; x < 90; ++x) mask.Put(x, y, false);
  }
  mask.Put(120, 100, false);
  const CutMap map = MakeCutMap(SheetOf(mask));
  EXPECT_EQ(map.figures.islands, 2);
  EXPECT_NEAR(map.figures.islands_mm2, 1.01, 1e-9);
  EXPECT_EQ(map.figures.pieces, 1);
  EXPECT_EQ(map.figures.holes, 1);
  // The line passes the large island on both sides and the small one on one: 5.8 + 5.8 mm of bars and the ring's second
  // half.
  EXPECT_GT(map.figures.length_mm, 11.6);
  EXPECT_LT(map.figures.length_mm, 15);
}

TEST(CutMap, CutOutDiscIsAPieceAndNoIsland) {
  const auto circle = Curve(200, [](double u) {
    return Vec2d(100 + 50 * std::cos(2 * std::numbers::pi * u), 100 + 50 * std::sin(2 * std::numbers::pi * u));
  });
  Mask mask(200, 200);
  Stroke(&mask, circle, 5);
  const CutMap map = MakeCutMap(SheetOf(mask));
  EXPECT_EQ(map.figures.islands, 0);
  EXPECT_EQ(map.figures.pieces, 2);
}

TEST(CutMap, StraightCutFollowsItsMetal) {
  Mask mask(200, 300);
  Stroke(&mask, {{100, 50}, {100, 250}}, 6);
  RecordedCut cut = SheetOf(mask);
  AddWay(&cut, {10, 5}, {10, 25});
  cut.lengths = {{0.5, 0}, {1, 0.0002}, {2, 0.011}, {2.02, 0.012}, {2.04, 0.0115}, {3, 0.0212}};
  const CutMap map = MakeCutMap(std::move(cut));
  const CutFigures& figures = map.figures;
  EXPECT_DOUBLE_EQ(figures.open_pct, 100);
  EXPECT_NEAR(figures.way_mm, 20, 0.01);
  EXPECT_NEAR(figures.length_mm, 21.2, 0.03 * 21.2);
  EXPECT_NEAR(figures.width_mm_p50, 1.2, 0.1);
  EXPECT_LT(figures.off_way_mm_p95, 0.65);
  EXPECT_DOUBLE_EQ(figures.beyond_metal_pct, 0);
  EXPECT_NEAR(figures.spot_way_ratio, 1, 1e-6);
  EXPECT_NEAR(figures.reported_length_mm, 21.2, 1e-4);
  EXPECT_EQ(figures.falls, 1);
  EXPECT_NEAR(figures.jump_mm_max, 11.8, 1e-4);
}

TEST(CutMap, CountsWhatIsRemovedBeyondTheMetal) {
  Mask mask(200, 300);
  Stroke(&mask, {{100, 50}, {100, 150}}, 6);
  Stroke(&mask, {{140, 50}, {140, 150}}, 6);  // 4 mm beside it.
  RecordedCut cut = SheetOf(mask);
  AddWay(&cut, {10, 5}, {10, 15});
  EXPECT_NEAR(MakeCutMap(std::move(cut)).figures.beyond_metal_pct, 50, 1e-9);
}

TEST(CutMap, NoiseOfTheSpotIsNoWayButItsLeapsAre) {
  Mask mask(200, 300);
  Stroke(&mask, {{100, 50}, {100, 250}}, 6);
  RecordedCut noisy = SheetOf(mask);
  AddWay(&noisy, {10, 5}, {10, 25});
  RecordedCut leaping = noisy;
  for (std::size_t i = 0; i < noisy.current.size(); ++i) {
    noisy.current[i].material.x() += i % 2 == 0 ? 0.03e-3f : -0.03e-3f;
    leaping.current[i].material.x() += i % 2 == 0 ? 1e-3f : -1e-3f;
  }
  EXPECT_NEAR(MakeCutMap(std::move(noisy)).figures.spot_way_ratio, 1, 0.1);
  EXPECT_NEAR(MakeCutMap(std::move(leaping)).figures.spot_way_ratio, 20, 0.5);
}

TEST(CutMap, ClosedHalfOfTheWayIsTold) {
  Mask mask(200, 300);
  Stroke(&mask, {{100, 50}, {100, 150}}, 6);
  RecordedCut cut = SheetOf(mask);
  AddWay(&cut, {10, 5}, {10, 25});
  const CutMap map = MakeCutMap(std::move(cut));
  EXPECT_NEAR(map.figures.open_pct, 100 * 10.6 / 20, 2);
}

TEST(CutMap, TissueThatSlipsOffTheMetalIsNotAtCuttingPower) {
  Mask mask(200, 300);
  Stroke(&mask, {{100, 50}, {100, 148}}, 6);
  Stroke(&mask, {{100, 170}, {100, 250}}, 6);
  RecordedCut cut = SheetOf(mask);
  AddWay(&cut, {10, 5}, {10, 25});
  for (MetalFrame& frame : cut.metal) {
    frame.power_W = 35;
    frame.vaporising_J_m = 500;
  }
  // From 15 to 17 mm in one period: 200 mm/s, at which 35 W vaporise no slit of this width.
  std::erase_if(cut.metal,
                [](const MetalFrame& frame) { return frame.centre.y() > 15.05e-3f && frame.centre.y() < 16.95e-3f; });
  for (std::size_t i = 0; i < cut.metal.size(); ++i) cut.metal[i].time_s = 1 + 0.01 * static_cast<double>(i);
  RecordedCut slow = cut;
  const CutFigures figures = MakeCutMap(std::move(cut)).figures;
  EXPECT_DOUBLE_EQ(figures.open_pct, 100);
  EXPECT_NEAR(figures.open_pct_all, 95, 1);
  for (MetalFrame& frame : slow.metal) frame.vaporising_J_m = 100;
  EXPECT_NEAR(MakeCutMap(std::move(slow)).figures.open_pct, 95, 1);
}

TEST(CutMap, LengthIsHeldAgainstTheLongestLine) {
  // Two slits side by side; after two seconds the strip between them is removed.
  Mask slits(200, 300), all(200, 300);
  for (const double x : {90.0, 110.0}) Stroke(&slits, {{x, 50}, {x, 250}}, 5);
  Stroke(&all, {{100, 50}, {100, 250}}, 15);
  RecordedCut cut = SheetOf(all);
  cut.texels.removed_s.assign(cut.texels.removed.size(), std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < all.set.size(); ++i) {
    if (all.set[i] != 0) cut.texels.removed_s[i] = slits.set[i] != 0 ? 1.0f : 3.0f;
  }
  cut.lengths = {{0.5, 0}, {1, 0.02}, {2, 0.042}, {3, 0.042}};
  const CutFigures figures = MakeCutMap(std::move(cut)).figures;
  EXPECT_LT(figures.length_mm, 24);
  EXPECT_NEAR(figures.longest_mm, 2 * 21.0, 0.03 * 42);
  EXPECT_NEAR(figures.length_error_pct, 0, 3);
}

TEST(CutMap, NothingCutIsDrawnToo) {
  const CutMap map = MakeCutMap(SheetOf(Mask(100, 100)));
  EXPECT_FALSE(map.has_cut());
  EXPECT_EQ(DrawCutMap(map, "nothing").substr(1, 3), "PNG");
  EXPECT_NE(FiguresJson(map).find("\"open_pct\": null"), std::string::npos);
}

}  // namespace
}  // namespace fulcrum::log_tools
