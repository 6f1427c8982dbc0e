#include "services/scene/compiler/shapes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "services/base/core/error.h"
#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/print_text.h"

namespace fulcrum::scene {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMostStations = 2000;  ///< More vertices than a scene holds.

/// Place on a swept shape's line, with directions across it that do not turn about it.
struct Station {
  Vec3d centre, right, up;
  double radius;
};

/// Stations about `spacing` apart, evenly spread over the curve.
std::vector<Station> StationsOf(const ShapeSettings& shape, double spacing) {
  constexpr int kFine = 32;  // Per stretch between given points.
  const auto& line = shape.line_m;
  const auto at = [&](std::ptrdiff_t i) {
    const auto last = static_cast<std::ptrdiff_t>(line.size()) - 1;
    if (i < 0) return Vec3d((2 * line[0] - line[1]).cast<double>());
    if (i > last) return Vec3d((2 * line[line.size() - 1] - line[line.size() - 2]).cast<double>());
    return Vec3d(line[static_cast<std::size_t>(i)].cast<double>());
  };
  std::vector<Vec3d> points;
  std::vector<double> radius, length;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const auto k = static_cast<std::ptrdiff_t>(i);
    for (int j = 0; j < kFine + (i + 2 == line.size() ? 1 : 0); ++j) {
      const double f = static_cast<double>(j) / kFine;
      points.push_back(CatmullRom(at(k - 1), at(k), at(k + 1), at(k + 2), f));
      const double smooth = f * f * (3 - 2 * f);
      radius.push_back((1 - smooth) * shape.radius_m[i] + smooth * shape.radius_m[i + 1]);
      length.push_back(length.empty() ? 0 : length.back() + (points.back() - points[points.size() - 2]).norm());
    }
  }
  if (length.back() > kMostStations * spacing) {
    throw InputError(PrintText("a line of %.0f mm has rings every %.2f mm; valid: at most %d of them",
                               1e3 * length.back(), 1e3 * spacing, kMostStations));
  }
  const int count = std::max(2, static_cast<int>(std::lround(length.back() / spacing)) + 1);
  std::vector<Station> stations;
  for (int i = 0; i < count; ++i) {
    const double s = length.back() * i / (count - 1);
    const auto k = std::clamp<std::size_t>(
        static_cast<std::size_t>(std::upper_bound(length.begin(), length.end(), s) - length.begin()), 1,
        length.size() - 1);
    const double f = std::clamp((s - length[k - 1]) / std::max(length[k] - length[k - 1], 1e-12), 0.0, 1.0);
    const Vec3d along = (points[k] - points[k - 1]).normalized();
    Station station{(1 - f) * points[k - 1] + f * points[k], Vec3d::Zero(), Vec3d::Zero(),
                    (1 - f) * radius[k - 1] + f * radius[k]};
    // The last direction across, made perpendicular to the line here.
    Vec3d right = stations.empty() ? along.unitOrthogonal() : stations.back().right;
    right = (right - right.dot(along) * along).normalized();
    station.right = right;
    station.up = along.cross(right);
    stations.push_back(station);
  }
  return stations;
}

Vec3d Around(const Station& s, double radius, int segment, int segments) {
  const double angle = 2 * kPi * segment / segments;
  return s.centre + radius * (std::cos(angle) * s.right + std::sin(angle) * s.up);
}

/// Rings of `segments` vertices, one after another, and a vertex at either end.
TriangleMesh CloseRings(std::vector<Vec3d> vertices, int rings, int segments, const Vec3d& first, const Vec3d& last) {
  TriangleMesh mesh;
  mesh.vertices = std::move(vertices);
  const auto id = [&](int ring, int segment) { return static_cast<Index>(ring * segments + segment % segments); };
  const auto pole = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.push_back(first);
  mesh.vertices.push_back(last);
  for (int s = 0; s < segments; ++s) {
    mesh.triangles.push_back({pole, id(0, s + 1), id(0, s)});
    mesh.triangles.push_back({pole + 1, id(rings - 1, s), id(rings - 1, s + 1)});
    for (int r = 0; r + 1 < rings; ++r) {
      mesh.triangles.push_back({id(r, s), id(r, s + 1), id(r + 1, s + 1)});
      mesh.triangles.push_back({id(r, s), id(r + 1, s + 1), id(r + 1, s)});
    }
  }
  return mesh;
}

TriangleMesh Swept(const ShapeSettings& shape) {
  constexpr int kSegments = 32, kCap = 8;
  const double largest = *std::max_element(shape.radius_m.begin(), shape.radius_m.end());
  const std::vector<Station> stations = StationsOf(shape, 2 * kPi * largest / kSegments);
  std::vector<Vec3d> vertices;
  int rings = 0;
  const auto ring = [&](const Station& s, double radius, const Vec3d& shift) {
    for (int k = 0; k < kSegments; ++k) vertices.push_back(Around(s, radius, k, kSegments) + shift);
    ++rings;
  };
  const auto cap = [&](const Station& s, double sign) {
    for (int i = 1; i < kCap; ++i) {
      const double angle = 0.5 * kPi * (sign < 0 ? kCap - i : i) / kCap;
      ring(s, s.radius * std::cos(angle), sign * s.radius * std::sin(angle) * s.right.cross(s.up));
    }
  };
  const Station &first = stations.front(), &last = stations.back();
  cap(first, -1);
  for (const Station& s : stations) ring(s, s.radius, Vec3d::Zero());
  cap(last, 1);
  return CloseRings(std::move(vertices), rings, kSegments, first.centre - first.radius * first.right.cross(first.up),
                    last.centre + last.radius * last.right.cross(last.up));
}

TriangleMesh Ellipsoid(const ShapeSettings& shape) {
  constexpr int kSegments = 48, kRings = 25;
  const Vec3d radii = shape.radii_m->cast<double>(), turn = shape.turn_rad.cast<double>();
  const Mat3d R = (Eigen::AngleAxisd(turn.z(), Vec3d::UnitZ()) * Eigen::AngleAxisd(turn.y(), Vec3d::UnitY()) *
                   Eigen::AngleAxisd(turn.x(), Vec3d::UnitX()))
                      .toRotationMatrix();
  const auto at = [&](double latitude, double longitude) {
    const Vec3d unit(std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                     std::sin(latitude));
    return Vec3d(shape.at_m.cast<double>() + R * radii.cwiseProduct(unit));
  };
  std::vector<Vec3d> vertices;
  for (int r = 0; r < kRings; ++r) {
    for (int s = 0; s < kSegments; ++s) {
      vertices.push_back(at(kPi * ((r + 1.0) / (kRings + 1) - 0.5), 2 * kPi * s / kSegments));
    }
  }
  return CloseRings(std::move(vertices), kRings, kSegments, at(-0.5 * kPi, 0), at(0.5 * kPi, 0));
}

}  // namespace

TriangleMesh SurfaceOfShape(const ShapeSettings& shape) { return shape.radii_m ? Ellipsoid(shape) : Swept(shape); }

TubeBody TubeOfShape(const ShapeSettings& shape, double spacing) {
  constexpr int kSides = 6, kFine = 12;
  const std::vector<Station> stations = StationsOf(shape, spacing);
  const auto rings = static_cast<int>(stations.size());
  TubeBody body;
  body.ring_vertices = kSides + 1;
  // By station: the middle, then the ring.
  const auto id = [](int ring, int side) {
    return static_cast<Index>(ring * (kSides + 1) + (side < 0 ? 0 : 1 + side % kSides));
  };
  for (int r = 0; r < rings; ++r) {
    for (int side = -1; side < kSides; ++side) {
      const Station& s = stations[static_cast<std::size_t>(r)];
      body.tets.vertices.push_back(side < 0 ? s.centre : Around(s, s.radius, side, kSides));
    }
  }
  const auto add = [&](Tetrahedron t, bool turned) {
    const auto& x = body.tets.vertices;
    if (turned) std::swap(t[2], t[3]);
    if (!(SignedVolume(x[t[0]], x[t[1]], x[t[2]], x[t[3]]) > 0)) {
      const Vec3d at = 1e3 * x[t[0]];
      throw InputError(
          PrintText("bends more tightly than its radius, or between two rings, near %.1f %.1f %.1f mm; "
                    "give more points, a smaller radius or a smaller tet_edge_mm",
                    at.x(), at.y(), at.z()));
    }
    body.tets.tets.push_back(t);
  };
  for (int r = 0; r + 1 < rings; ++r) {
    for (int side = 0; side < kSides; ++side) {
      // A wedge between two triangles of one numbering: the split along the numbers agrees with those of its
      // neighbours.
      std::array<int, 3> corner{-1, side, (side + 1) % kSides};
      std::sort(corner.begin(), corner.end());
      const auto low = [&](std::size_t k) { return id(r, corner[k]); };
      const auto high = [&](std::size_t k) { return id(r + 1, corner[k]); };
      // At the last side the order of the numbers turns round.
      const bool turned = side == kSides - 1;
      add({low(0), low(1), low(2), high(2)}, turned);
      add({low(0), low(1), high(2), high(1)}, turned);
      add({low(0), high(0), high(1), high(2)}, turned);
    }
  }
  std::vector<Vec3d> vertices;
  for (const Station& s : stations) {
    for (int k = 0; k < kFine; ++k) vertices.push_back(Around(s, s.radius, k, kFine));
  }
  body.surface = CloseRings(std::move(vertices), rings, kFine, stations.front().centre, stations.back().centre);
  return body;
}

}  // namespace fulcrum::scene
