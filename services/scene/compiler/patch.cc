#include <algorithm>
#include <cmath>
#include <functional>

#include "services/scene/compiler/drape.h"
#include "services/scene/compiler/height_map.h"
#include "services/scene/compiler/sheet_grid.h"
#include "services/scene/compiler/spot.h"

namespace fulcrum::scene {
namespace {

constexpr double kSteepest = 1.2;      ///< Slope of the sheet beside something that protrudes: 50 degrees.
constexpr double kLeastCovered = 0.5;  ///< Share of the rectangle below which there must be organ.
constexpr int kHeightSmoothing = 6, kPatchSmoothing = 20, kPatchRounds = 4;
/// The gap decreases over this share of the patch, or this many gaps if that is more, to …
constexpr double kRimTaper = 0.15, kGapsOfTaper = 3.5;
constexpr double kRimGap = 0.12;  ///< … this share of it at the rim.

/// The lowest surface above `heights` that is nowhere steeper than kSteepest: the envelope of cones under every sample.
/// Two passes over the eight neighbours (a chamfer transform).
void LimitSlope(double dx, double dy, Grid<double>* heights) {
  const double diagonal = std::hypot(dx, dy);
  const auto raise = [&](int r, int c, int dr, int dc, double distance) {
    const int r2 = r + dr, c2 = c + dc;
    if (r2 >= 0 && r2 < heights->rows && c2 >= 0 && c2 < heights->cols) {
      heights->at(r, c) = std::max(heights->at(r, c), heights->at(r2, c2) - kSteepest * distance);
    }
  };
  for (int r = 0; r < heights->rows; ++r) {
    for (int c = 0; c < heights->cols; ++c) {
      raise(r, c, 0, -1, dx), raise(r, c, -1, 0, dy), raise(r, c, -1, -1, diagonal), raise(r, c, -1, 1, diagonal);
    }
    for (int c = heights->cols - 1; c >= 0; --c) raise(r, c, 0, 1, dx);
  }
  for (int r = heights->rows - 1; r >= 0; --r) {
    for (int c = 0; c < heights->cols; ++c) {
      raise(r, c, 0, -1, dx), raise(r, c, 1, 0, dy), raise(r, c, 1, -1, diagonal), raise(r, c, 1, 1, diagonal);
    }
    for (int c = heights->cols - 1; c >= 0; --c) raise(r, c, 0, 1, dx);
  }
}

/// The sheet above the heights, by the gap measured across their slope.
SheetGrid OnHeights(const Grid<double>& heights, double width, double length, const MembraneSettings& membrane,
                    const std::function<double(int, int)>& gap) {
  SheetGrid sheet(membrane.rows, membrane.cols, Vec3d::Zero());
  for (int r = 0; r < membrane.rows; ++r) {
    for (int c = 0; c < membrane.cols; ++c) {
      constexpr double kStep = 0.01;
      const double t = static_cast<double>(r) / (membrane.rows - 1), s = static_cast<double>(c) / (membrane.cols - 1);
      const double dx = heights.Sample(t, std::min(s + kStep, 1.0)) - heights.Sample(t, std::max(s - kStep, 0.0));
      const double dy = heights.Sample(std::min(t + kStep, 1.0), s) - heights.Sample(std::max(t - kStep, 0.0), s);
      const double slope = std::hypot(dx / (2 * kStep * width), dy / (2 * kStep * length));
      sheet.at(r, c) = Vec3d((s - 0.5) * width, (t - 0.5) * length,
                             heights.Sample(t, s) + gap(r, c) * std::hypot(1.0, std::min(slope, kSteepest)));
    }
  }
  return sheet;
}

Vec3d Up(int /*row*/) { return Vec3d::UnitZ(); }

}  // namespace

std::vector<Vec3d> DrapePatch(double width, double length, const MembraneSettings& membrane, const TriangleMesh& organ,
                              const std::string& name) {
  Grid<double> heights = HeightsOf(organ, width, length);
  const auto covered =
      std::count_if(heights.values.begin(), heights.values.end(), [](double h) { return h > kNoHeight; });
  if (static_cast<double>(covered) < kLeastCovered * static_cast<double>(heights.values.size())) {
    throw SpotError(name + ": below " + std::to_string(100 - 100 * covered / (kHeightSamples * kHeightSamples)) +
                        " % of the membrane's patch there is no organ; valid: at most " +
                        std::to_string(static_cast<int>(100 - 100 * kLeastCovered)) +
                        " %. Choose another `at_mm` or `facing`, or a smaller `width_mm` and `length_mm`",
                    {{organ}, Vec3d::Zero()});
  }
  LimitSlope(width / (kHeightSamples - 1), length / (kHeightSamples - 1), &heights);
  heights.Smooth(kHeightSmoothing, false);
  const auto taper = [&](double side) {
    return std::min(0.5, std::max(kRimTaper, kGapsOfTaper * membrane.gap_m / side));
  };
  const auto gap = [&](int r, int c) {
    const double t = static_cast<double>(r) / (membrane.rows - 1), s = static_cast<double>(c) / (membrane.cols - 1);
    const double x = std::min({1.0, std::min(s, 1 - s) / taper(width), std::min(t, 1 - t) / taper(length)});
    return membrane.gap_m * (kRimGap + (1 - kRimGap) * x * x * (3 - 2 * x));
  };
  const SheetGrid start = OnHeights(heights, width, length, membrane, gap);
  SheetGrid sheet = start;
  const TriangleLocator locator(organ.vertices, organ.triangles);
  for (int round = 0; round < kPatchRounds; ++round) {
    // The rim is kept: smoothing would contract the sheet.
    sheet.Smooth(kPatchSmoothing, true);
    PushOut(organ, locator, 2 * membrane.gap_m, gap, &sheet);
    Spread(&sheet);
  }
  if (FoldOf(sheet, Up)) sheet = start;  // On a rough organ: what stands on heights cannot fold.
  CheckFolds(sheet, organ, Up, name, "Choose another `at_mm` or `facing`, or a smaller `width_mm` and `length_mm`");
  return sheet.values;
}

}  // namespace fulcrum::scene
