// Length, width and deviation of the centre line on holes of known shape.
#include "thermal_node/coupling/cut_meter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "thermal_node/topology/crumbs.h"

namespace fulcrum::thermal {
namespace {

constexpr float kHalf_m = 6.5e-4f;      ///< Half the width of a usual slit.
constexpr float kStep_m = 4e-4f;        ///< Distance between two updates: 8 mm/s at 20 Hz.
constexpr float kMostRise_m = 1.0e-3f;  ///< Largest increase of the length in such a step.
constexpr float kPi = std::numbers::pi_v<float>;

/// A sheet, its removed cells, and its meter.
class Cut {
 public:
  /// Removes the cells for which `inside` is true within a square of half side `reach_m` about a place; noted for the
  /// next Update.
  void Take(const Vec2f& at, float reach_m, const std::function<bool(const Vec2f&)>& inside) {
    const CellIndex low = field.sheet().CellOf(at - Vec2f::Constant(reach_m));
    const CellIndex high = field.sheet().CellOf(at + Vec2f::Constant(reach_m));
    for (int iy = low.iy; iy <= high.iy; ++iy) {
      for (int ix = low.ix; ix <= high.ix; ++ix) {
        const CellIndex cell{ix, iy};
        if (!field.sheet().Contains(cell) || IsHole(field, cell) || !inside(field.sheet().CentreOf(cell))) continue;
        std::uint8_t& flags = field.Wake(ix / kTile, iy / kTile)->state.flags[(iy % kTile) * kTile + ix % kTile];
        flags = static_cast<std::uint8_t>(flags | kRemoved);
        removed.Add(cell);
      }
    }
  }
  void Disc(const Vec2f& at, float radius_m) {
    Take(at, radius_m, [&](const Vec2f& p) { return (p - at).norm() <= radius_m; });
  }
  void Update() {
    if (removed.empty()) return;
    removed.Add(crumbs.TakeOut(&field, removed, &ledger));
    const float before = meter.length_m();
    meter.Update(field, removed.low, removed.high);
    removed = {};
    EXPECT_GE(meter.length_m(), before);
    if (before > 0.0f) largest_rise_m = std::max(largest_rise_m, meter.length_m() - before);
  }
  /// Moves a tip along a curve, from parameter 0 to `length_m`, with an update each kStep_m.
  void Along(const std::function<Vec2f(float)>& curve, float length_m, float half_m = kHalf_m) {
    constexpr float kFine_m = 5e-5f;
    const auto count = static_cast<int>(std::lround(length_m / kFine_m));
    const auto between = static_cast<int>(std::lround(kStep_m / kFine_m));
    for (int n = 0; n <= count; ++n) {
      const float at = length_m * static_cast<float>(n) / static_cast<float>(count);
      Disc(curve(at), half_m);
      meter.AddPath(curve(std::max(at - kFine_m, 0.0f)), curve(at));
      if (n % between == between - 1 || n == count) Update();
    }
  }
  void Line(const Vec2f& from, const Vec2f& to, float half_m = kHalf_m) {
    const float length = (to - from).norm();
    Along([&](float s) { return Vec2f(from + s / length * (to - from)); }, length, half_m);
  }

  HeatField field{MakeFlatSheet(0.06f, 0.05f, 1e-4f), MakeMaterial(ThermalParams{})};
  CutMeter meter;
  RemovedBox removed;
  Crumbs crumbs;
  Ledger ledger;
  float largest_rise_m = 0;
};

/// A round-ended slit grown from the middle of the sheet, `length_m` from end to end.
void Straight(float angle, float length_m, float half_m, Cut* cut) {
  const Vec2f direction(std::cos(angle), std::sin(angle)), middle(0.0301f, 0.0252f);
  const float inner = length_m - 2 * half_m;
  cut->Line(middle - 0.5f * inner * direction, middle + 0.5f * inner * direction, half_m);
}

std::function<Vec2f(float)> Circle(float radius_m) {
  return [=](float s) {
    return Vec2f(0.03f + radius_m * std::cos(s / radius_m), 0.025f + radius_m * std::sin(s / radius_m));
  };
}

TEST(CutMeterTest, StraightSlitsOfAnyAngleAndWidthAreMeasured) {
  constexpr float kLength_m = 0.016f;
  for (const float half_m : {1.0e-4f, 3.0e-4f, kHalf_m, 9.0e-4f, 1.8e-3f}) {
    for (int degrees = 0; degrees <= 90; degrees += 5) {
      SCOPED_TRACE(std::to_string(2e3f * half_m) + " mm at " + std::to_string(degrees) + " degrees");
      Cut cut;
      Straight(static_cast<float>(degrees) * kPi / 180, kLength_m, half_m, &cut);
      EXPECT_NEAR(cut.meter.length_m(), kLength_m, 0.015f * kLength_m);
      EXPECT_LE(cut.largest_rise_m, 0.7e-3f);
      // The widths of one slit differ by a cell; widths beyond twice the reach are not measured.
      EXPECT_NEAR(cut.meter.width_p50_m(), 2 * half_m, 1e-4f);
      EXPECT_NEAR(cut.meter.width_p95_m(), 2 * half_m, 1e-4f);
      EXPECT_LE(cut.meter.off_path_p95_m(), 1e-4f);
    }
  }
}

TEST(CutMeterTest, SquareEndsAreReached) {
  for (const float angle : {0.0f, 0.3f, 0.6f}) {
    Cut cut;
    const Vec2f middle(0.03f, 0.02f), along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
    cut.Take(middle, 0.008f, [&](const Vec2f& p) {
      return std::abs((p - middle).dot(along)) <= 0.007f && std::abs((p - middle).dot(across)) <= 9e-4f;
    });
    cut.Update();
    EXPECT_NEAR(cut.meter.length_m(), 0.014f, 0.05f * 0.014f) << angle;
  }
}

TEST(CutMeterTest, CircleGrowsWithoutJumpsAndARingCountsOnce) {
  for (const float radius_m : {0.003f, 0.006f, 0.01f}) {
    Cut cut;
    const float round_m = 2 * kPi * radius_m;
    cut.Along(Circle(radius_m), 0.75f * round_m);
    EXPECT_NEAR(cut.meter.length_m(), 0.75f * round_m + 2 * kHalf_m, 0.02f * round_m);
    // Closes the ring: the crumb within the smallest ring is too large to be debris, so the ring is kept.
    cut.Along(Circle(radius_m), round_m);
    EXPECT_NEAR(cut.meter.length_m(), round_m, 0.02f * round_m);
    EXPECT_LE(cut.largest_rise_m, 0.7e-3f);
  }
}

TEST(CutMeterTest, LengthAdvancesEvenlyThroughoutALongCut) {
  Cut cut;
  constexpr float kLength_m = 0.1f;
  // An Archimedean spiral; ds/da of r = r0 + c a by steps.
  std::vector<Vec2f> points;
  constexpr float kPitch_m = 5e-4f, kFine_m = 5e-5f;
  float angle = 0;
  for (int n = 0; n <= static_cast<int>(kLength_m / kFine_m) + 1; ++n) {
    const float radius = 0.005f + kPitch_m * angle;
    points.push_back(Vec2f(0.03f, 0.025f) + radius * Vec2f(std::cos(angle), std::sin(angle)));
    angle += kFine_m / std::hypot(radius, kPitch_m);
  }
  cut.Along([&](float s) { return points[static_cast<std::size_t>(std::lround(s / kFine_m))]; }, kLength_m);
  EXPECT_NEAR(cut.meter.length_m(), kLength_m + 2 * kHalf_m, 0.02f * kLength_m);
  EXPECT_LE(cut.largest_rise_m, 0.7e-3f);
}

TEST(CutMeterTest, BranchesCountOnceAndComeWithoutAJump) {
  for (const float angle : {0.5f, 0.8f, 1.1f, kPi / 2}) {
    Cut cut;
    cut.Line({0.01f, 0.02f}, {0.03f, 0.02f});
    const float bar_m = cut.meter.length_m();
    const Vec2f fork(0.02f, 0.02f), end = fork + 0.012f * Vec2f(std::cos(angle), std::sin(angle));
    cut.largest_rise_m = 0;
    cut.Line(fork, end);
    // The published length follows more slowly; a branch must not be added at once.
    EXPECT_LE(cut.largest_rise_m, 2 * kMostRise_m) << angle;
    // At an acute fork the two centre lines coincide for a while.
    const float shared_m = kHalf_m / std::tan(0.5f * angle);
    EXPECT_LE(cut.meter.length_m() - bar_m, 0.012f + 1.1f * kHalf_m) << angle;
    EXPECT_GE(cut.meter.length_m() - bar_m, 0.012f + 0.5f * kHalf_m - 0.8f * shared_m) << angle;
  }
}

TEST(CutMeterTest, CrossingAndSeparateSlitsAddUp) {
  Cut cut;
  cut.Line({0.005f, 0.010f}, {0.025f, 0.010f});
  cut.Line({0.015f, 0.004f}, {0.015f, 0.016f});
  EXPECT_NEAR(cut.meter.length_m(), 0.032f + 4 * kHalf_m, 0.03f * 0.032f);
  cut.Line({0.005f, 0.032f}, {0.015f, 0.036f});
  EXPECT_NEAR(cut.meter.length_m(), 0.032f + 0.01077f + 6 * kHalf_m, 0.03f * 0.043f);
}

TEST(CutMeterTest, TwoSlitsThatMeetBecomeOne) {
  Cut cut;
  cut.Line({0.010f, 0.02f}, {0.020f, 0.021f});
  cut.Line({0.035f, 0.02f}, {0.025f, 0.021f});
  const float apart_m = cut.meter.length_m();
  EXPECT_NEAR(apart_m, 2 * (0.01005f + 2 * kHalf_m), 0.03f * apart_m);
  cut.Line({0.025f, 0.021f}, {0.020f, 0.021f});
  EXPECT_NEAR(cut.meter.length_m(), 2 * 0.01005f + 0.005f + 2 * kHalf_m, 0.03f * 0.026f);
}

TEST(CutMeterTest, WhatIsRemovedBesideASlitWidensItAndAddsNoLength) {
  for (const float aside_m : {0.0f, 3e-4f, 6e-4f, 9e-4f, 1.1e-3f}) {
    Cut cut;
    cut.Line({0.01f, 0.02f}, {0.03f, 0.022f});
    const float once_m = cut.meter.length_m();
    cut.Line({0.012f, 0.0202f + aside_m}, {0.027f, 0.0217f + aside_m});
    EXPECT_LE(cut.meter.length_m() - once_m, 3e-4f) << aside_m;
    EXPECT_NEAR(cut.meter.width_p50_m(), 2 * kHalf_m + aside_m, 1.5e-4f) << aside_m;
  }
}

TEST(CutMeterTest, ARoughBorderAddsLittle) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (const float rough_m : {1e-4f, 2e-4f}) {
    for (const float angle : {0.0f, 0.35f, 0.8f}) {
      Cut cut;
      const Vec2f along(std::cos(angle), std::sin(angle));
      for (int n = 0; n <= 200; ++n) {
        const Vec2f aside = rough_m * Vec2f(uniform(random), uniform(random));
        cut.Disc(Vec2f(0.015f, 0.01f) + 1e-4f * static_cast<float>(n) * along + aside,
                 kHalf_m + rough_m * uniform(random));
        if (n % 4 == 0) cut.Update();
      }
      EXPECT_NEAR(cut.meter.length_m(), 0.020f + 2 * kHalf_m, 0.03f * 0.0213f) << rough_m << ' ' << angle;
      // The front itself is as rough.
      EXPECT_LE(cut.largest_rise_m, 0.7e-3f + 2 * rough_m) << rough_m << ' ' << angle;
    }
  }
}

TEST(CutMeterTest, AHoleThatIsNoLongerThanWideCountsByItsLongestExtent) {
  for (const float radius_m : {3e-4f, 1e-3f, 1.8e-3f}) {
    Cut cut;
    cut.Disc({0.03f, 0.02f}, radius_m);
    cut.Update();
    EXPECT_NEAR(cut.meter.length_m(), 2 * radius_m, 1.5e-4f) << radius_m;
  }
  Cut cell;
  cell.Disc({0.03005f, 0.02005f}, 4e-5f);
  cell.Update();
  EXPECT_GT(cell.meter.length_m(), 0.0f);
  EXPECT_LE(cell.meter.length_m(), 1.5e-4f);
}

TEST(CutMeterTest, LengthNeverFalls) {
  Cut cut;
  cut.Line({0.01f, 0.01f}, {0.03f, 0.01f});
  const float slit_m = cut.meter.length_m();
  // The slit becomes a part of a large hole, whose centre line is much shorter. Update() must not reduce the length.
  cut.Take({0.02f, 0.01f}, 0.012f, [](const Vec2f&) { return true; });
  cut.Update();
  EXPECT_GE(cut.meter.length_m(), slit_m);
}

TEST(CutMeterTest, StrayingIsTheDistanceFromTheWay) {
  Cut cut;
  cut.meter.AddPath({0.01f, 0.0205f}, {0.02f, 0.0205f});
  cut.meter.AddPath({0.02f, 0.0205f}, {0.03f, 0.0205f});
  for (int n = 0; n <= 50; ++n) {
    cut.Disc({0.01f + 4e-4f * static_cast<float>(n), 0.02f}, kHalf_m);
    cut.Update();
  }
  EXPECT_NEAR(cut.meter.off_path_p95_m(), 5e-4f, 1e-4f);
  // A repeated path adds few points, and after a path on the line itself the distance is that of the nearest path.
  const std::size_t points = cut.meter.path().points().size();
  for (int n = 0; n < 20; ++n) cut.meter.AddPath({0.01f, 0.0205f}, {0.03f, 0.0205f});
  EXPECT_LE(cut.meter.path().points().size(), points + 2);
  cut.meter.AddPath({0.01f, 0.02f}, {0.03f, 0.02f});
  cut.Disc({0.0304f, 0.02f}, kHalf_m);
  cut.Update();
  EXPECT_LE(cut.meter.off_path_p95_m(), 1e-4f);
}

std::vector<CellIndex> LineOf(const CutMeter& meter) {
  std::vector<CellIndex> line;
  for (const LineCell& cell : meter.line()) line.push_back(cell.at);
  return line;
}

TEST(CutMeterTest, GoesOnInTheSameBitsFromItsStateAndTheHole) {
  Cut cut;
  cut.Along(Circle(0.006f), 0.025f);
  cut.Line({0.036f, 0.025f}, {0.05f, 0.030f});
  CutMeter restored;
  const auto same = [&] {
    return restored.length_m() == cut.meter.length_m() && restored.width_p50_m() == cut.meter.width_p50_m() &&
           restored.width_p95_m() == cut.meter.width_p95_m() &&
           restored.off_path_p95_m() == cut.meter.off_path_p95_m() &&
           std::equal(restored.line().begin(), restored.line().end(), cut.meter.line().begin(), cut.meter.line().end());
  };
  ASSERT_TRUE(restored.Restore(cut.field, cut.meter.length_m(), LineOf(cut.meter), cut.meter.path().points(),
                               cut.meter.path().end()));
  EXPECT_TRUE(same());
  for (int n = 0; n <= 60; ++n) {
    const Vec2f from(0.05f - 2e-4f * static_cast<float>(n), 0.030f), to = from - Vec2f(2e-4f, 0);
    cut.meter.AddPath(from, to);
    restored.AddPath(from, to);
    cut.Disc(to + Vec2f(0, 3e-4f), kHalf_m);
    const RemovedBox removed = cut.removed;
    cut.Update();
    restored.Update(cut.field, removed.low, removed.high);
    ASSERT_TRUE(same()) << n;
  }
}

TEST(CutMeterTest, TheLineFoundAnewMeasuresTheSame) {
  Cut cut;
  cut.Along(Circle(0.006f), 0.045f);
  cut.Line({0.036f, 0.025f}, {0.05f, 0.030f});
  CutMeter anew;
  anew.Rebuild(cut.field);
  EXPECT_NEAR(anew.length_m(), cut.meter.length_m(), 0.01f * cut.meter.length_m());
}

TEST(CutMeterTest, StateThatCannotBeOfThisHoleIsRefused) {
  Cut cut;
  cut.Line({0.01f, 0.02f}, {0.03f, 0.02f});
  const std::vector<CellIndex> line = LineOf(cut.meter);
  const std::vector<ToolPath::Point> path(cut.meter.path().points().begin(), cut.meter.path().points().end());
  const ToolPath::End end = cut.meter.path().end();
  const auto accepts = [&](float length_m, const auto& cells, const auto& points, const ToolPath::End& last) {
    CutMeter meter;
    const bool good = meter.Restore(cut.field, length_m, cells, points, last);
    EXPECT_EQ(good, !meter.line().empty());
    return good;
  };
  EXPECT_TRUE(accepts(0.02f, line, path, end));
  EXPECT_FALSE(accepts(-1.0f, line, path, end));
  EXPECT_FALSE(accepts(NAN, line, path, end));
  std::vector<CellIndex> cells = line;
  std::swap(cells[3], cells[4]);
  EXPECT_FALSE(accepts(0.02f, cells, path, end));
  cells = line;
  cells.back().iy += 40;
  EXPECT_FALSE(accepts(0.02f, cells, path, end));
  std::vector<ToolPath::Point> points = path;
  points[5].previous = 6;
  EXPECT_FALSE(accepts(0.02f, line, points, end));
  points = path;
  points[5].s = NAN;
  EXPECT_FALSE(accepts(0.02f, line, points, end));
  EXPECT_FALSE(accepts(0.02f, line, path, ToolPath::End{0, 0, static_cast<std::uint32_t>(path.size())}));
}

/// Pieces of a set of cells that touch over faces or corners.
int PieceCount(const std::function<bool(CellIndex)>& in, const Sheet& sheet) {
  std::vector<bool> seen(static_cast<std::size_t>(sheet.nx) * static_cast<std::size_t>(sheet.ny), false);
  const auto take = [&](CellIndex c) {
    if (!sheet.Contains(c) || !in(c)) return false;
    const auto k = static_cast<std::size_t>(c.iy) * static_cast<std::size_t>(sheet.nx) + static_cast<std::size_t>(c.ix);
    const bool fresh = !seen[k];
    seen[k] = true;
    return fresh;
  };
  int pieces = 0;
  for (int k = 0; k < sheet.nx * sheet.ny; ++k) {
    std::vector<CellIndex> stack{{k % sheet.nx, k / sheet.nx}};
    if (!take(stack[0])) continue;
    ++pieces;
    while (!stack.empty()) {
      const CellIndex c = stack.back();
      stack.pop_back();
      for (int n = 0; n < 9; ++n) {
        const CellIndex next{c.ix + n % 3 - 1, c.iy + n / 3 - 1};
        if (take(next)) stack.push_back(next);
      }
    }
  }
  return pieces;
}

TEST(CutMeterTest, TheLineOfRandomStrokesHasThePiecesOfTheHole) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int round = 0; round < 4; ++round) {
    Cut cut;
    for (int stroke = 0; stroke < 12; ++stroke) {
      const float half_m = 1e-4f + 1.2e-3f * uniform(random), angle = 2 * kPi * uniform(random);
      const Vec2f from(0.06f * uniform(random), 0.05f * uniform(random));
      cut.Line(from, from + 0.012f * uniform(random) * Vec2f(std::cos(angle), std::sin(angle)), half_m);
      const auto in_hole = [&](CellIndex c) { return IsHole(cut.field, c); };
      const auto in_line = [&](CellIndex c) {
        const auto line = cut.meter.line();
        const auto before = [](const LineCell& a, CellIndex b) {
          return a.at.iy != b.iy ? a.at.iy < b.iy : a.at.ix < b.ix;
        };
        const auto at = std::lower_bound(line.begin(), line.end(), c, before);
        return at != line.end() && at->at == c;
      };
      ASSERT_EQ(PieceCount(in_line, cut.field.sheet()), PieceCount(in_hole, cut.field.sheet()))
          << round << ' ' << stroke;
      // The line that grew with the hole equals the line found in the whole hole; only the published length may be
      // longer.
      CutMeter anew;
      anew.Rebuild(cut.field);
      ASSERT_NEAR(anew.length_m(), cut.meter.length_m(), 0.03f * cut.meter.length_m() + 1e-3f)
          << round << ' ' << stroke;
    }
  }
}

TEST(CutMeterTest, HolesAtTheSheetsBorderEndThere) {
  Cut cut;
  cut.Line({0.0f, 0.02f}, {0.02f, 0.02f});
  EXPECT_NEAR(cut.meter.length_m(), 0.02f + kHalf_m, 0.02f * 0.02f);
}

}  // namespace
}  // namespace fulcrum::thermal
