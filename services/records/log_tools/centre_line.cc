#include "services/records/log_tools/centre_line.h"

#include <algorithm>
#include <cmath>

#include "services/records/log_tools/thinning.h"

namespace fulcrum::log_tools {
namespace {

/// Factor of magnification before thinning: halves the error of half a pixel that thinning causes at even widths.
constexpr double kFine = 2;
/// Mean difference, over odd and even widths, between the distance to the next clear pixel's centre and the distance to
/// the edge of the clear region [pixels].
constexpr double kToEdge = 0.25;

/// A branch counts with this factor times its excess (CentreLine::length).
constexpr double kBranchSlope = 4;

struct Course {
  std::vector<Vec2d> points;
  std::vector<double> half_widths;
  bool closed = false;
};

/// Mean over `window` of arc length about each point. The ends stay in place, because the window shrinks to zero there.
std::vector<Vec2d> Smoothed(const Course& course, double window) {
  const auto n = static_cast<int>(course.points.size());
  const auto at = [&](int i) { return course.points[static_cast<std::size_t>(((i % n) + n) % n)]; };
  std::vector<Vec2d> smooth(course.points.size());
  for (int i = 0; i < n; ++i) {
    const int most = course.closed ? (n - 1) / 2 : std::min(i, n - 1 - i);
    Vec2d sum = at(i);
    int reach = 0;
    for (double before = 0, after = 0; reach < most;) {
      const int k = reach + 1;
      before += (at(i - k) - at(i - k + 1)).norm();
      after += (at(i + k) - at(i + k - 1)).norm();
      if (0.5 * (before + after) > 0.5 * window) break;
      sum += at(i - k) + at(i + k);
      reach = k;
    }
    smooth[static_cast<std::size_t>(i)] = sum / (2 * reach + 1);
  }
  return smooth;
}

double LengthOf(const std::vector<Vec2d>& points, bool closed) {
  double length = closed ? (points.front() - points.back()).norm() : 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

/// Direction in which a line continues beyond its front, from the points within `window`.
Vec2d Outward(const std::vector<Vec2d>& points, double window) {
  for (const Vec2d& point : points) {
    const Vec2d out = points.front() - point;
    if (out.norm() >= window) return out.normalized();
  }
  const Vec2d out = points.front() - points.back();
  return out.norm() > 0 ? Vec2d(out.normalized()) : Vec2d::UnitX();
}

/// Distance to the clear region at the ridge: thinning can leave a line up to one pixel beside it.
double RidgeAt(const Pixel& at, const std::vector<float>& distance, const Mask& fine) {
  float ridge = 0;
  for (int y = at.y - 1; y <= at.y + 1; ++y) {
    for (int x = at.x - 1; x <= at.x + 1; ++x) {
      if (fine.Contains(x, y)) ridge = std::max(ridge, distance[fine.Index(x, y)]);
    }
  }
  return static_cast<double>(ridge);
}

CentreLine::Stretch StretchOf(const Branch& branch, const Skeleton& skeleton, const std::vector<float>& distance,
                              const Mask& fine, double window) {
  Course course;
  course.closed = branch.closed;
  for (const Pixel& at : branch.pixels) {
    course.points.emplace_back(at.x + 0.5, at.y + 0.5);
    course.half_widths.push_back(RidgeAt(at, distance, fine) - kToEdge);
  }
  const auto junction = [&](int number) { return skeleton.junctions[static_cast<std::size_t>(number)]; };
  if (branch.from >= 0) {
    course.points.insert(course.points.begin(), junction(branch.from).centre);
    course.half_widths.insert(course.half_widths.begin(),
                              static_cast<double>(junction(branch.from).half_width) - kToEdge);
  }
  if (branch.to >= 0) {
    course.points.push_back(junction(branch.to).centre);
    course.half_widths.push_back(static_cast<double>(junction(branch.to).half_width) - kToEdge);
  }
  std::vector<Vec2d> points = Smoothed(course, window);
  std::vector<double> half_widths = course.half_widths;
  // Extends a free end to the end of the hole; a single pixel is extended to both sides.
  for (int side = 0; side < 2; ++side) {
    if (!branch.closed && (side == 0 ? branch.from : branch.to) < 0) {
      const Pixel& last = side == 0 ? branch.pixels.front() : branch.pixels.back();
      const double reach = static_cast<double>(distance[fine.Index(last.x, last.y)]) - kToEdge;
      const Vec2d out = points.size() > 1 ? Outward(points, 0.5 * window) : Vec2d(side == 0 ? -1 : 1, 0);
      const Vec2d end = points.front() + reach * out;
      points.insert(points.begin(), end);
      half_widths.insert(half_widths.begin(), half_widths.front());
    }
    std::reverse(points.begin(), points.end());
    std::reverse(half_widths.begin(), half_widths.end());
  }
  CentreLine::Stretch stretch;
  stretch.closed = branch.closed;
  stretch.counted = stretch.length = LengthOf(points, branch.closed) / kFine;
  for (std::size_t i = 0; i < points.size(); ++i) {
    stretch.points.push_back({points[i] / kFine, 2 * half_widths[i] / kFine});
  }
  return stretch;
}

/// Limits `counted` of branches.
void CountBranches(const Skeleton& skeleton, const std::vector<float>& distance, const Mask& thin, double beyond,
                   std::vector<CentreLine::Stretch>* stretches) {
  std::vector<std::vector<std::size_t>> spurs(skeleton.junctions.size());
  std::vector<std::size_t> degree(skeleton.junctions.size());
  for (std::size_t n = 0; n < skeleton.branches.size(); ++n) {
    const Branch& branch = skeleton.branches[n];
    for (const int junction : {branch.from, branch.to}) {
      if (junction >= 0) ++degree[static_cast<std::size_t>(junction)];
    }
    if (branch.from >= 0 && branch.to < 0) spurs[static_cast<std::size_t>(branch.from)].push_back(n);
  }
  for (std::size_t junction = 0; junction < spurs.size(); ++junction) {
    auto& here = spurs[junction];
    std::sort(here.begin(), here.end(),
              [&](std::size_t a, std::size_t b) { return (*stretches)[a].length < (*stretches)[b].length; });
    here.resize(std::min(here.size(), std::max<std::size_t>(degree[junction], 2) - 2));
    for (const std::size_t n : here) {
      const double excess = std::max(ExcessOf(skeleton.branches[n], skeleton, distance, thin, beyond), 0.0);
      CentreLine::Stretch& stretch = (*stretches)[n];
      stretch.counted = std::min(stretch.length, kBranchSlope * excess / kFine);
    }
  }
}

}  // namespace

CentreLine FindCentreLine(const Mask& hole, const CentreLineSettings& settings) {
  const Mask fine = Doubled(hole);
  const std::vector<float> distance = DistanceToClear(fine);
  Mask thin = Thinned(fine, distance);
  const double beyond = kFine * settings.spur;
  PruneSpurs(&thin, distance, beyond);
  const Skeleton skeleton = Trace(thin, distance);
  CentreLine line;
  for (const Branch& branch : skeleton.branches) {
    line.stretches.push_back(StretchOf(branch, skeleton, distance, fine, kFine * settings.smooth));
  }
  CountBranches(skeleton, distance, thin, beyond, &line.stretches);
  return line;
}

}  // namespace fulcrum::log_tools
