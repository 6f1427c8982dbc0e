#include "services/scene/compiler/placement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>

#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/height_map.h"

namespace fulcrum::scene {
namespace {

constexpr int kBands = 24;              ///< Of geodesic distance, along a tube.
constexpr int kRounds = 3;              ///< In which the bands are made anew along the line.
constexpr int kLineSmoothing = 3;       ///< Each moves a point half way to the mean of its neighbours.
constexpr double kLeastElongation = 2;  ///< Length over mean diameter: a shorter body is no tube.
/// Share of the body's silhouette, either way, that a patch covers: the corners of a larger one leave a round body.
constexpr double kPatchShare = 0.65;
constexpr double kLeastPatch_m = 0.005, kLargestPatch_m = 0.25;
/// The normal of a patch is the mean over this share of the body's size.
constexpr double kNormalReach = 0.12;

using Graph = std::vector<std::vector<std::pair<Index, double>>>;

Graph EdgeGraph(const TriangleMesh& mesh) {
  Graph graph(mesh.vertices.size());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      graph[a].emplace_back(b, (mesh.vertices[a] - mesh.vertices[b]).norm());
    }
  }
  return graph;
}

/// Length of the shortest path along edges from `start`; infinity where there is none.
std::vector<double> DistancesFrom(const Graph& graph, Index start) {
  std::vector<double> distance(graph.size(), std::numeric_limits<double>::infinity());
  using Entry = std::pair<double, Index>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance[start] = 0;
  queue.emplace(0.0, start);
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > distance[v]) continue;
    for (const auto& [next, length] : graph[v]) {
      if (d + length < distance[next]) {
        distance[next] = d + length;
        queue.emplace(distance[next], next);
      }
    }
  }
  return distance;
}

Index FarthestOf(const std::vector<double>& distance) {
  Index farthest = 0;
  double most = -1;
  for (Index v = 0; v < distance.size(); ++v) {
    if (std::isfinite(distance[v]) && distance[v] > most) {
      farthest = v;
      most = distance[v];
    }
  }
  return farthest;
}

struct Foot {
  double distance;  ///< From the line.
  double along;     ///< Length of the line up to the nearest point.
};

Foot FootOn(const Vec3d& p, const std::vector<Vec3d>& line) {
  Foot foot{std::numeric_limits<double>::infinity(), 0};
  double passed = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Vec3d along = line[i + 1] - line[i];
    const double length = along.norm();
    const double f = std::clamp((p - line[i]).dot(along) / (length * length), 0.0, 1.0);
    const double distance = (line[i] + f * along - p).norm();
    if (distance < foot.distance) foot = {distance, passed + f * length};
    passed += length;
  }
  return foot;
}

double LengthOf(const std::vector<Vec3d>& line) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    length += (line[i + 1] - line[i]).norm();
  }
  return length;
}

/// Centroids of the surface's bands, smoothed. @param place 0 … 1 along the body for a triangle and its middle.
template <class Place>
std::vector<Vec3d> MiddlesOfBands(const TriangleMesh& surface, const Place& place) {
  std::vector<Vec3d> sum(kBands, Vec3d::Zero());
  std::vector<double> weight(kBands, 0);
  for (const Triangle& t : surface.triangles) {
    const Vec3d &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
    const Vec3d middle = (a + b + c) / 3;
    const double at = place(t, middle);
    if (!std::isfinite(at)) continue;
    const auto band = static_cast<std::size_t>(std::clamp(at * kBands, 0.0, kBands - 1.0));
    const double area = (b - a).cross(c - a).norm() / 2;
    sum[band] += area * middle;
    weight[band] += area;
  }
  std::vector<Vec3d> line;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    if (weight[i] > 0) line.push_back(sum[i] / weight[i]);
  }
  for (int k = 0; k < kLineSmoothing; ++k) {
    const std::vector<Vec3d> old = line;
    for (std::size_t i = 1; i + 1 < line.size(); ++i) {
      line[i] = 0.5 * old[i] + 0.25 * (old[i - 1] + old[i + 1]);
    }
  }
  return line;
}

/// Whether a line is that of a tube around it.
bool IsLong(const TriangleMesh& surface, const std::vector<Vec3d>& line) {
  double radius = 0, area = 0;
  for (const Triangle& t : surface.triangles) {
    const Vec3d &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
    const double share = (b - a).cross(c - a).norm() / 2;
    radius += share * FootOn((a + b + c) / 3, line).distance;
    area += share;
  }
  return LengthOf(line) > kLeastElongation * 2 * radius / area;
}

/// Turned so that its largest component is positive: the same direction whatever the order of the file.
Vec3d WithPositiveSense(const Vec3d& direction) {
  Eigen::Index largest;
  direction.cwiseAbs().maxCoeff(&largest);
  return direction[largest] < 0 ? Vec3d(-direction) : direction;
}

struct AreaMoments {
  double area = 0;
  Vec3d centroid = Vec3d::Zero();
  Mat3d covariance = Mat3d::Zero();
};

AreaMoments MomentsOf(const TriangleMesh& surface) {
  AreaMoments moments;
  const auto each = [&](const auto& take) {
    for (const Triangle& t : surface.triangles) {
      const Vec3d &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
      take((b - a).cross(c - a).norm() / 2, Vec3d((a + b + c) / 3));
    }
  };
  each([&](double area, const Vec3d& p) {
    moments.area += area;
    moments.centroid += area * p;
  });
  moments.centroid /= moments.area;
  each([&](double area, const Vec3d& p) {
    moments.covariance += area / moments.area * (p - moments.centroid) * (p - moments.centroid).transpose();
  });
  return moments;
}

/// Outward normal around the point of the surface nearest to `p`.
Vec3d NormalAround(const TriangleMesh& surface, const Vec3d& p, Vec3d* nearest) {
  const double size = LongestSide(surface.vertices);
  const TriangleLocator locator(surface.vertices, surface.triangles);
  const auto hit = locator.Closest(p, 10 * size + (p - surface.vertices[0]).norm());
  *nearest = hit.triangle == kNoIndex ? surface.vertices[0] : hit.closest.point;
  const Triangle& at = surface.triangles[hit.triangle == kNoIndex ? 0 : hit.triangle];
  const auto normal = [&](const Triangle& t) -> Vec3d {
    const Vec3d& a = surface.vertices[t[0]];
    return (surface.vertices[t[1]] - a).cross(surface.vertices[t[2]] - a);
  };
  const Vec3d own = normal(at).normalized();
  Vec3d sum = Vec3d::Zero();
  for (const Triangle& t : surface.triangles) {
    const Vec3d middle = (surface.vertices[t[0]] + surface.vertices[t[1]] + surface.vertices[t[2]]) / 3;
    // A wall's other side faces away from this one.
    if ((middle - *nearest).norm() < kNormalReach * size && normal(t).dot(own) > 0) sum += normal(t);
  }
  return sum.norm() > 0 ? Vec3d(sum.normalized()) : own;
}

/// The organ's outline as seen from above.
class Silhouette {
 public:
  Silhouette(const Grid<double>& heights, double width, double length)
      : width_(width), length_(length), covered_(heights) {
    for (double& value : covered_.values) value = value > kNoHeight ? 1 : 0;
  }

  /// The point of the outline farthest from its border; of several, the nearest to the middle.
  [[nodiscard]] Vec2d Deepest() const {
    // Chamfer distances: two passes over the eight neighbours. The border of the grid counts as outside.
    const double dx = width_ / (kHeightSamples - 1), dy = length_ / (kHeightSamples - 1), diagonal = std::hypot(dx, dy);
    Grid<double> depth = covered_;
    const auto at = [&](int r, int c) {
      return r < 0 || c < 0 || r >= depth.rows || c >= depth.cols ? 0.0 : depth.at(r, c);
    };
    for (double& value : depth.values) value *= width_ + length_;
    for (int r = 0; r < depth.rows; ++r) {
      for (int c = 0; c < depth.cols; ++c) {
        depth.at(r, c) = std::min({depth.at(r, c), at(r, c - 1) + dx, at(r - 1, c) + dy, at(r - 1, c - 1) + diagonal,
                                   at(r - 1, c + 1) + diagonal});
      }
    }
    Vec2d best = Vec2d::Zero();
    double deepest = -1;
    for (int r = depth.rows - 1; r >= 0; --r) {
      for (int c = depth.cols - 1; c >= 0; --c) {
        depth.at(r, c) = std::min({depth.at(r, c), at(r, c + 1) + dx, at(r + 1, c) + dy, at(r + 1, c + 1) + diagonal,
                                   at(r + 1, c - 1) + diagonal});
        const Vec2d place((static_cast<double>(c) / (kHeightSamples - 1) - 0.5) * width_,
                          (static_cast<double>(r) / (kHeightSamples - 1) - 0.5) * length_);
        const double value = depth.at(r, c) - kCentring * place.norm();
        if (value > deepest) {
          deepest = value;
          best = place;
        }
      }
    }
    return best;
  }

  /// Reduces the sides of a rectangle until the organ is below nearly all of it.
  void Shrink(const Vec2d& middle, double least, Vec2d* sides) const {
    constexpr double kCovered = 0.93, kStep = 0.95;
    while (Covered(middle, *sides) < kCovered && sides->minCoeff() > least) {
      const Vec2d narrower(kStep * sides->x(), sides->y()), shorter(sides->x(), kStep * sides->y());
      *sides = Covered(middle, narrower) >= Covered(middle, shorter) ? narrower : shorter;
    }
  }

 private:
  static constexpr double kCentring = 0.15;  ///< Depth that is given up for being so much nearer to the middle.

  [[nodiscard]] double Covered(const Vec2d& middle, const Vec2d& sides) const {
    constexpr int kSamples = 24;
    double sum = 0;
    for (int i = 0; i <= kSamples; ++i) {
      for (int k = 0; k <= kSamples; ++k) {
        const Vec2d p = middle + Vec2d(sides.x() * (static_cast<double>(i) / kSamples - 0.5),
                                       sides.y() * (static_cast<double>(k) / kSamples - 0.5));
        const double row = p.y() / length_ + 0.5, col = p.x() / width_ + 0.5;
        if (row >= 0 && row <= 1 && col >= 0 && col <= 1) sum += covered_.Sample(row, col);
      }
    }
    return sum / ((kSamples + 1) * (kSamples + 1));
  }

  double width_, length_;
  Grid<double> covered_;
};

/// Rows are the axes x, y, z of W, with z along `up` and y as near to `along` as possible.
Mat3d FrameOf(const Vec3d& up, const Vec3d& along) {
  const Vec3d z = up.normalized();
  Vec3d y = along - along.dot(z) * z;
  if (!(y.norm() > 1e-6 * along.norm())) y = z.unitOrthogonal();
  y.normalize();
  Mat3d R_WF;
  R_WF.row(0) = y.cross(z).transpose();
  R_WF.row(1) = y.transpose();
  R_WF.row(2) = z.transpose();
  return R_WF;
}

}  // namespace

double LongestSide(const std::vector<Vec3d>& points) {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Vec3d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return points.empty() ? 0 : (high - low).maxCoeff();
}

double LongestSide(const MeshFile& file) {
  std::vector<Vec3d> used;
  for (const Triangle& t : file.triangles) {
    for (const Index v : t) used.push_back(file.vertices[v]);
  }
  for (const Tetrahedron& t : file.tets) {
    for (const Index v : t) used.push_back(file.vertices[v]);
  }
  return LongestSide(used);
}

std::vector<Vec3d> FindCentreLine(const TriangleMesh& surface) {
  const Graph graph = EdgeGraph(surface);
  // Twice the farthest: the first start may lie anywhere.
  const Index end = FarthestOf(DistancesFrom(graph, surface.triangles[0][0]));
  const std::vector<double> distance = DistancesFrom(graph, end);
  const double longest = distance[FarthestOf(distance)];
  std::vector<Vec3d> line = MiddlesOfBands(surface, [&](const Triangle& t, const Vec3d&) {
    return (distance[t[0]] + distance[t[1]] + distance[t[2]]) / 3 / longest;
  });
  if (line.size() < 3 || !IsLong(surface, line)) return {};
  // Bands of distance from an end lie oblique to the tube; bands along the line itself do not.
  for (int round = 0; round < kRounds; ++round) {
    const double length = LengthOf(line);
    line = MiddlesOfBands(surface, [&](const Triangle&, const Vec3d& p) { return FootOn(p, line).along / length; });
    if (line.size() < 3) return {};
  }
  if (!IsLong(surface, line)) return {};
  const Vec3d chord = line.back() - line.front();
  if (WithPositiveSense(chord).dot(chord) < 0) std::reverse(line.begin(), line.end());
  return line;
}

std::vector<Placement> PlacesOfTube(const std::vector<Vec3d>& line, const ImportSettings& import) {
  const Vec3d chord = (line.back() - line.front()).normalized();
  Vec3d up = import.facing ? Vec3d(import.facing->cast<double>()) : Vec3d::UnitZ();
  // Along the tube no direction leads out of it.
  if (!(up.normalized().cross(chord).norm() > 0.5)) up = std::abs(chord.y()) < 0.8 ? Vec3d::UnitY() : Vec3d::UnitX();
  up = (up - up.dot(chord) * chord).normalized();
  const Vec3d side = chord.cross(up);
  std::vector<Placement> places;
  for (const Vec3d& direction : {up, side, Vec3d(-side), Vec3d(-up)}) {
    Placement placement;
    placement.R_WF = FrameOf(direction, chord);
    placement.origin_m = line[line.size() / 2];
    for (const Vec3d& p : line) {
      placement.centre_line.push_back(placement.ToWorld(p));
    }
    places.push_back(std::move(placement));
    if (import.facing) break;
  }
  return places;
}

Placement PlacePatch(const TriangleMesh& surface, const ImportSettings& import) {
  const AreaMoments moments = MomentsOf(surface);
  const Eigen::SelfAdjointEigenSolver<Mat3d> axes(moments.covariance);  // Ascending.
  Placement placement;
  Vec3d up = WithPositiveSense(axes.eigenvectors().col(0));
  placement.origin_m = moments.centroid;
  Vec3d at = moments.centroid;
  if (import.patch_at_m) up = NormalAround(surface, import.patch_at_m->cast<double>(), &at);
  if (import.facing) up = import.facing->cast<double>();
  placement.R_WF = FrameOf(up, WithPositiveSense(axes.eigenvectors().col(2)));
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Vec3d& p : surface.vertices) {
    low = low.cwiseMin(placement.ToWorld(p));
    high = high.cwiseMax(placement.ToWorld(p));
  }
  const double width = high.x() - low.x(), length = high.y() - low.y();
  placement.origin_m += placement.R_WF.transpose() * Vec3d(0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), 0);
  TriangleMesh placed = surface;
  for (Vec3d& p : placed.vertices) p = placement.ToWorld(p);
  const Silhouette silhouette(HeightsOf(placed, width, length), width, length);
  Vec2d middle = silhouette.Deepest();
  if (import.patch_at_m) middle = placement.ToWorld(at).head<2>();
  placement.origin_m += placement.R_WF.transpose() * Vec3d(middle.x(), middle.y(), 0);
  const auto size = [](double share, double extent) {
    return std::clamp(share * extent, kLeastPatch_m, kLargestPatch_m);
  };
  Vec2d sides(size(kPatchShare, width), size(kPatchShare, length));
  silhouette.Shrink(middle, kLeastPatch_m, &sides);
  placement.patch_width_m = import.patch_width_m > 0 ? import.patch_width_m : sides.x();
  placement.patch_length_m = import.patch_length_m > 0 ? import.patch_length_m : sides.y();
  return placement;
}

}  // namespace fulcrum::scene
