#include "services/scene/compiler/drape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/sheet_grid.h"
#include "services/scene/compiler/spot.h"

namespace fulcrum::scene {
namespace {

constexpr int kRadiusRows = 65, kRadiusAngles = 65;  ///< Samples of the organ's outer radius.
/// If a larger share of the rays misses, the centre line is not inside the organ.
constexpr double kMissedRays = 0.10;
constexpr int kRadiusSmoothing = 12, kSheetSmoothing = 40;
constexpr double kTaper = 0.12;  ///< Share of the length at either end over which the gap decreases to …
constexpr double kEndGap = 0.3;  ///< … this share of it: there the membrane is fused with the organ.
constexpr double kFlareTurn_rad = 0.7;

struct CrossFrame {
  Vec3d centre, right, up;
  [[nodiscard]] Vec3d Direction(double angle) const { return std::cos(angle) * up + std::sin(angle) * right; }
};

CrossFrame FrameAt(const CentreLine& line, double fraction, const Vec3d& facing) {
  CrossFrame frame;
  frame.centre = line.At(fraction);
  const Vec3d tangent = line.Tangent(fraction);
  frame.right = tangent.cross(facing).normalized();
  frame.up = frame.right.cross(tangent);
  return frame;
}

/// Distance along the ray to the first triangle through which it leaves the mesh (the outer side: the ray may begin in
/// the lumen, within the wall or in a filled organ). Negative if there is none. Moeller and Trumbore's intersection.
double ExitDistance(const TriangleMesh& mesh, const Vec3d& origin, const Vec3d& direction) {
  double nearest = std::numeric_limits<double>::max();
  bool hit = false;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d &a = mesh.vertices[t[0]], e1 = mesh.vertices[t[1]] - a, e2 = mesh.vertices[t[2]] - a;
    const Vec3d p = direction.cross(e2);
    const double determinant = e1.dot(p);
    if (determinant >= 0) {
      continue;  // Seen from outside: the ray enters here.
    }
    const Vec3d s = origin - a;
    const double u = s.dot(p) / determinant;
    if (u < 0 || u > 1) {
      continue;
    }
    const Vec3d q = s.cross(e1);
    const double v = direction.dot(q) / determinant, distance = e2.dot(q) / determinant;
    if (v >= 0 && u + v <= 1 && distance > 0 && distance < nearest) {
      nearest = distance;
      hit = true;
    }
  }
  return hit ? nearest : -1;
}

Grid<double> OuterRadius(const ImportSettings& import, const CentreLine& line, const Vec3d& facing,
                         const TriangleMesh& organ, const std::string& name) {
  Grid<double> radius(kRadiusRows, kRadiusAngles, -1.0);
  int missed = 0;
  double mean = 0;
  Vec3d outside = Vec3d::Zero();
  for (int r = 0; r < kRadiusRows; ++r) {
    const double fraction = import.from + (import.to - import.from) * r / (kRadiusRows - 1);
    const CrossFrame frame = FrameAt(line, fraction, facing);
    for (int a = 0; a < kRadiusAngles; ++a) {
      const double angle = (static_cast<double>(a) / (kRadiusAngles - 1) - 0.5) * import.sector_rad;
      const double distance = ExitDistance(organ, frame.centre, frame.Direction(angle));
      radius.at(r, a) = distance;
      missed += distance < 0 ? 1 : 0;
      if (distance < 0) outside = frame.centre;
      mean += std::max(distance, 0.0);
    }
  }
  if (missed > kMissedRays * kRadiusRows * kRadiusAngles) {
    throw SpotError(name + ": " + std::to_string(100 * missed / (kRadiusRows * kRadiusAngles)) +
                        " % of the rays from the centre line do not leave the organ; valid: at most " +
                        std::to_string(static_cast<int>(100 * kMissedRays)) + " %. The centre line must run inside it",
                    {{organ}, outside});
  }
  mean /= kRadiusRows * kRadiusAngles - missed;
  for (double& value : radius.values) {
    value = value < 0 ? mean : value;
  }
  radius.Smooth(kRadiusSmoothing, false);
  return radius;
}

/// One row before resampling: flare, arc over the organ, flare.
std::vector<Vec3d> RowLine(const CrossFrame& frame, const Grid<double>& radius, double row, double gap,
                           const ImportSettings& import) {
  constexpr int kArc = 200, kFlare = 30;
  std::vector<Vec3d> arc;
  for (int i = 0; i <= kArc; ++i) {
    const double angle = (static_cast<double>(i) / kArc - 0.5) * import.sector_rad;
    arc.push_back(frame.centre + (radius.Sample(row, static_cast<double>(i) / kArc) + gap) * frame.Direction(angle));
  }
  const auto flare = [&](const Vec3d& from, const Vec3d& along, double side) {
    std::vector<Vec3d> points;
    const Vec3d out = side * frame.right;
    Vec3d at = from;
    for (int i = 1; i <= kFlare; ++i) {
      // Leaves along the arc and turns away from the organ.
      const double turn = kFlareTurn_rad * i / kFlare;
      at += import.flare_m / kFlare * (std::cos(turn) * along + std::sin(turn) * out).normalized();
      points.push_back(at);
    }
    return points;
  };
  // Direction over the last tenth of the arc: a single segment would contain the noise of the surface.
  std::vector<Vec3d> line = flare(arc.front(), (arc.front() - arc[kArc / 10]).normalized(), -1);
  std::reverse(line.begin(), line.end());
  line.insert(line.end(), arc.begin(), arc.end());
  const std::vector<Vec3d> right = flare(arc.back(), (arc.back() - arc[kArc - kArc / 10]).normalized(), 1);
  line.insert(line.end(), right.begin(), right.end());
  return line;
}

}  // namespace

// -------------------------------------------------------------------------------------------------- CentreLine

CentreLine::CentreLine(const std::vector<Vec3d>& points) {
  constexpr int kPerPiece = 40;
  const auto count = static_cast<int>(points.size());
  const auto at = [&](int i) {
    return i < 0        ? Vec3d(2 * points[0] - points[1])
           : i >= count ? Vec3d(2 * points[count - 1] - points[count - 2])
                        : points[i];
  };
  for (int i = 0; i + 1 < count; ++i) {
    for (int k = 0; k < kPerPiece + (i + 2 == count ? 1 : 0); ++k) {
      const double f = static_cast<double>(k) / kPerPiece;
      const Vec3d p0 = at(i - 1), p1 = at(i), p2 = at(i + 1), p3 = at(i + 2);
      points_.push_back(0.5 * (2 * p1 + f * (p2 - p0) + f * f * (2 * p0 - 5 * p1 + 4 * p2 - p3) +
                               f * f * f * (3 * p1 - p0 - 3 * p2 + p3)));
      length_.push_back(points_.size() == 1 ? 0.0 : length_.back() + (points_.back() - *(points_.end() - 2)).norm());
    }
  }
}

Vec3d CentreLine::At(double fraction) const {
  const double wanted = std::clamp(fraction, 0.0, 1.0) * length();
  const auto next = std::upper_bound(length_.begin() + 1, length_.end() - 1, wanted);
  const auto i = static_cast<std::size_t>(next - length_.begin());
  const double step = length_[i] - length_[i - 1];
  const double f = step > 0 ? (wanted - length_[i - 1]) / step : 0;
  return (1 - f) * points_[i - 1] + f * points_[i];
}

Vec3d CentreLine::Tangent(double fraction) const {
  constexpr double kHalfWindow = 0.05;
  return (At(fraction + kHalfWindow) - At(fraction - kHalfWindow)).normalized();
}

double CentreLine::Project(const Vec3d& p) const {
  double best = std::numeric_limits<double>::max(), fraction = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const double distance = (points_[i] - p).squaredNorm();
    if (distance < best) {
      best = distance;
      fraction = length_[i] / length();
    }
  }
  return fraction;
}

// ------------------------------------------------------------------------------------------------------- drape

std::vector<Vec3d> DrapeMembrane(const ImportSettings& import, const MembraneSettings& membrane,
                                 const CentreLine& centre_line, const Vec3d& facing, const TriangleMesh& organ,
                                 const std::string& name) {
  const Grid<double> radius = OuterRadius(import, centre_line, facing, organ, name);
  SheetGrid sheet(membrane.rows, membrane.cols, Vec3d::Zero());
  std::vector<CrossFrame> frames;
  const auto gap = [&](int r, int) {
    const double t = static_cast<double>(r) / (membrane.rows - 1);
    const double x = std::clamp(std::min(t, 1 - t) / kTaper, 0.0, 1.0);
    return membrane.gap_m * (kEndGap + (1 - kEndGap) * x * x * (3 - 2 * x));
  };
  for (int r = 0; r < membrane.rows; ++r) {
    const double t = static_cast<double>(r) / (membrane.rows - 1);
    frames.push_back(FrameAt(centre_line, import.from + (import.to - import.from) * t, facing));
    const std::vector<Vec3d> row = Resample(RowLine(frames.back(), radius, t, gap(r, 0), import), membrane.cols);
    for (int c = 0; c < membrane.cols; ++c) {
      sheet.at(r, c) = row[c];
    }
  }
  const TriangleLocator locator(organ.vertices, organ.triangles);
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    sheet.Smooth(kSheetSmoothing, false);
    PushOut(organ, locator, 2 * membrane.gap_m, gap, &sheet);
    Spread(&sheet);
  }
  CheckFolds(
      sheet, organ, [&](int r) { return frames[static_cast<std::size_t>(r)].up; }, name,
      "Choose a shorter stretch, another facing, or a smaller sector or flare");
  return sheet.values;
}

TriangleMesh ContinueSideways(int rows, int cols, const std::vector<Vec3d>& sheet, double width) {
  constexpr int kSteps = 10, kRowStep = 4, kUnder = 2;
  constexpr double kBelow_m = 0.0004;
  TriangleMesh mesh;
  for (const int side : {0, 1}) {
    const auto first = static_cast<Index>(mesh.vertices.size());
    int lines = 0;
    for (int r = 0; r < rows; r = r + kRowStep < rows || r == rows - 1 ? r + kRowStep : rows - 1, ++lines) {
      const auto node = [&](int from_rim) -> const Vec3d& {
        return sheet[static_cast<std::size_t>(r) * cols + (side == 0 ? from_rim : cols - 1 - from_rim)];
      };
      const Vec3d& rim = node(0);
      const Vec3d out = (rim - node(std::min(4, cols - 1))).normalized();
      const int r0 = std::max(r - 1, 0), r1 = std::min(r + 1, rows - 1), c = side == 0 ? 1 : cols - 2;
      const auto at = [&](int row, int col) { return sheet[static_cast<std::size_t>(row) * cols + col]; };
      const Vec3d normal = (at(r, c + 1) - at(r, c - 1)).cross(at(r1, c) - at(r0, c)).normalized();
      for (int k = 0; k <= kSteps; ++k) {
        const Vec3d p = k == 0 ? node(kUnder) : Vec3d(rim + width * (k - 1) / (kSteps - 1) * out);
        mesh.vertices.push_back(p - kBelow_m * normal);
      }
    }
    for (int i = 0; i + 1 < lines; ++i) {
      for (int k = 0; k < kSteps; ++k) {
        const Index a = first + static_cast<Index>(i * (kSteps + 1) + k), b = a + kSteps + 1;
        // Outward on both sides: k runs to the left on side 0, to the right on side 1.
        if (side == 1) {
          mesh.triangles.push_back({a, a + 1, b + 1});
          mesh.triangles.push_back({a, b + 1, b});
        } else {
          mesh.triangles.push_back({a, b + 1, a + 1});
          mesh.triangles.push_back({a, b, b + 1});
        }
      }
    }
  }
  return mesh;
}

}  // namespace fulcrum::scene
