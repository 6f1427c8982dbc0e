#include "services/scene/builder/geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

namespace fulcrum::scene {

double SignedVolume(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  return (b - a).cross(c - a).dot(d - a) / 6.0;
}

DihedralRange DihedralAngles(const std::array<Vec3d, 4>& x) {
  DihedralRange range{180, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = i + 1; j < 4; ++j) {
      std::array<std::size_t, 2> rest{};
      std::size_t count = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        if (k != i && k != j) {
          rest[count++] = k;
        }
      }
      const Vec3d e = (x[j] - x[i]).normalized();
      const Vec3d a = x[rest[0]] - x[i], b = x[rest[1]] - x[i];
      const Vec3d p = a - a.dot(e) * e, q = b - b.dot(e) * e;
      const double angle = std::atan2(p.cross(q).norm(), p.dot(q)) * 180 / std::numbers::pi;
      range.least_deg = std::min(range.least_deg, angle);
      range.largest_deg = std::max(range.largest_deg, angle);
    }
  }
  return range;
}

ClosestPoint ClosestOnTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const auto at = [&](double u, double v, double w) {
    const Vec3d q = u * a + v * b + w * c;
    return ClosestPoint{{u, v, w}, q, (p - q).norm()};
  };
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) {
    return at(1, 0, 0);
  }
  const Vec3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) {
    return at(0, 1, 0);
  }
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double v = d1 / (d1 - d3);
    return at(1 - v, v, 0);
  }
  const Vec3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) {
    return at(0, 0, 1);
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double w = d2 / (d2 - d6);
    return at(1 - w, 0, w);
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return at(0, 1 - w, w);
  }
  const double sum = va + vb + vc;
  return at(va / sum, vb / sum, vc / sum);
}

double DihedralAngle(const Vec3d& x0, const Vec3d& x1, const Vec3d& x2, const Vec3d& x3) {
  const Vec3d e = x1 - x0;
  const Vec3d n1 = e.cross(x2 - x0), n2 = (x3 - x0).cross(e);
  return std::atan2(n1.cross(n2).dot(e.normalized()), n1.dot(n2));
}

std::vector<Triangle> GridTriangles(int rows, int cols) {
  std::vector<Triangle> triangles;
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < cols; ++c) {
      const auto n00 = static_cast<Index>(r * cols + c);
      const Index n10 = n00 + static_cast<Index>(cols);
      triangles.push_back({n00, n00 + 1, n10 + 1});
      triangles.push_back({n00, n10 + 1, n10});
    }
  }
  return triangles;
}

std::vector<Triangle> BoundaryOf(const std::vector<Tetrahedron>& tets) {
  // Faces of a positive tetrahedron, counter-clockwise seen from outside.
  constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  struct Face {
    Triangle sorted, oriented;
  };
  std::vector<Face> faces;
  faces.reserve(4 * tets.size());
  for (const Tetrahedron& tet : tets) {
    for (const auto& f : kFaces) {
      const Triangle oriented{tet[f[0]], tet[f[1]], tet[f[2]]};
      Triangle sorted = oriented;
      std::sort(sorted.begin(), sorted.end());
      faces.push_back({sorted, oriented});
    }
  }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.sorted < b.sorted; });
  std::vector<Triangle> boundary;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t j = i + 1;
    while (j < faces.size() && faces[j].sorted == faces[i].sorted) {
      ++j;
    }
    if (j == i + 1) {
      boundary.push_back(faces[i].oriented);
    }
    i = j;
  }
  return boundary;
}

std::vector<std::array<Index, 2>> EdgesOf(const std::vector<Tetrahedron>& tets) {
  std::vector<std::array<Index, 2>> edges;
  edges.reserve(6 * tets.size());
  for (const Tetrahedron& tet : tets) {
    for (int i = 0; i < 4; ++i) {
      for (int j = i + 1; j < 4; ++j) {
        edges.push_back({std::min(tet[i], tet[j]), std::max(tet[i], tet[j])});
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

// ------------------------------------------------------------------------------------------------ TriangleLocator

namespace {

constexpr int kMaxCells = 64;  // Per axis: bounds the memory of the grid for any mesh.

}  // namespace

TriangleLocator::TriangleLocator(const std::vector<Vec3d>& vertices, const std::vector<Triangle>& triangles)
    : vertices_(vertices), triangles_(triangles) {
  if (triangles.empty()) {
    cells_.resize(1);
    return;
  }
  Vec3d high = vertices[triangles[0][0]];
  low_ = high;
  double edge_sum = 0;
  for (const Triangle& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      low_ = low_.cwiseMin(vertices[t[k]]);
      high = high.cwiseMax(vertices[t[k]]);
      edge_sum += (vertices[t[k]] - vertices[t[(k + 1) % 3]]).norm();
    }
  }
  const double mean_edge = edge_sum / (3.0 * static_cast<double>(triangles.size()));
  const double extent = (high - low_).maxCoeff();
  cell_ = std::max({2 * mean_edge, extent / (kMaxCells - 1), 1e-9});
  for (int k = 0; k < 3; ++k) {
    size_[k] = 1 + static_cast<int>((high[k] - low_[k]) / cell_);
  }
  cells_.resize(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2]);
  for (Index i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    const auto a = CellOf(vertices[t[0]].cwiseMin(vertices[t[1]]).cwiseMin(vertices[t[2]]));
    const auto b = CellOf(vertices[t[0]].cwiseMax(vertices[t[1]]).cwiseMax(vertices[t[2]]));
    for (int x = a[0]; x <= b[0]; ++x) {
      for (int y = a[1]; y <= b[1]; ++y) {
        for (int z = a[2]; z <= b[2]; ++z) {
          cells_[Flat(x, y, z)].push_back(i);
        }
      }
    }
  }
}

std::array<int, 3> TriangleLocator::CellOf(const Vec3d& p) const {
  std::array<int, 3> cell;
  for (int k = 0; k < 3; ++k) {
    cell[k] = static_cast<int>(std::clamp(std::floor((p[k] - low_[k]) / cell_), 0.0, size_[k] - 1.0));
  }
  return cell;
}

std::size_t TriangleLocator::Flat(int x, int y, int z) const {
  return (static_cast<std::size_t>(x) * size_[1] + y) * size_[2] + z;
}

TriangleLocator::Hit TriangleLocator::Closest(const Vec3d& p, double reach) const {
  Hit best;
  if (triangles_.empty()) {
    return best;
  }
  best.closest.distance = reach;
  // Growing box around p: once it is as large as the best distance, nothing outside it can be nearer.
  for (double radius = std::min(cell_, reach);; radius *= 2) {
    const bool last = radius >= reach;
    const double r = std::min(radius, reach);
    const auto a = CellOf(p - Vec3d::Constant(r)), b = CellOf(p + Vec3d::Constant(r));
    for (int x = a[0]; x <= b[0]; ++x) {
      for (int y = a[1]; y <= b[1]; ++y) {
        for (int z = a[2]; z <= b[2]; ++z) {
          for (const Index i : cells_[Flat(x, y, z)]) {
            const Triangle& t = triangles_[i];
            const ClosestPoint c = ClosestOnTriangle(p, vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]);
            if (c.distance < best.closest.distance || (c.distance == best.closest.distance && i < best.triangle)) {
              best = {i, c};
            }
          }
        }
      }
    }
    if (last || (best.triangle != kNoIndex && best.closest.distance <= r)) {
      return best;
    }
  }
}

// ---------------------------------------------------------------------------------------------------- embedding

std::vector<Embedding> EmbedPoints(const std::vector<Vec3d>& vertices, const std::vector<Tetrahedron>& tets,
                                   const std::vector<Vec3d>& points) {
  // Inverse edge matrices once: barycentric (b, c, d) = inverse * (p - a).
  std::vector<Eigen::Matrix3d> inverse(tets.size());
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::max()), high = -low;
  double largest = 0;
  for (std::size_t i = 0; i < tets.size(); ++i) {
    const Tetrahedron& t = tets[i];
    Eigen::Matrix3d edges;
    edges << vertices[t[1]] - vertices[t[0]], vertices[t[2]] - vertices[t[0]], vertices[t[3]] - vertices[t[0]];
    inverse[i] = edges.inverse();
    Vec3d a = vertices[t[0]], b = a;
    for (int k = 1; k < 4; ++k) {
      a = a.cwiseMin(vertices[t[k]]);
      b = b.cwiseMax(vertices[t[k]]);
    }
    low = low.cwiseMin(a);
    high = high.cwiseMax(b);
    largest = std::max(largest, (b - a).maxCoeff());
  }
  // Cells as large as the largest tetrahedron; each tetrahedron is listed in every cell that it may touch and one
  // beyond.
  const double cell = std::max(largest, (high - low).maxCoeff() / kMaxCells);
  std::map<std::array<int, 3>, std::vector<Index>> cells;
  const auto cell_of = [&](const Vec3d& p) {
    const Vec3d q = (p - low) / cell;
    return std::array<int, 3>{static_cast<int>(std::floor(q[0])), static_cast<int>(std::floor(q[1])),
                              static_cast<int>(std::floor(q[2]))};
  };
  for (Index i = 0; i < tets.size(); ++i) {
    Vec3d a = vertices[tets[i][0]], b = a;
    for (int k = 1; k < 4; ++k) {
      a = a.cwiseMin(vertices[tets[i][k]]);
      b = b.cwiseMax(vertices[tets[i][k]]);
    }
    const auto first = cell_of(a - Vec3d::Constant(cell / 2)), last = cell_of(b + Vec3d::Constant(cell / 2));
    for (int x = first[0]; x <= last[0]; ++x) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int z = first[2]; z <= last[2]; ++z) {
          cells[{x, y, z}].push_back(i);
        }
      }
    }
  }
  std::vector<Index> everything(tets.size());
  for (Index i = 0; i < tets.size(); ++i) {
    everything[i] = i;
  }
  std::vector<Embedding> result;
  result.reserve(points.size());
  for (const Vec3d& p : points) {
    const auto found = cells.find(cell_of(p));
    const std::vector<Index>& candidates = found == cells.end() ? everything : found->second;
    Embedding best{kNoIndex, {0, 0, 0, 0}};
    double best_least = -std::numeric_limits<double>::max();
    for (const Index i : candidates) {
      const Vec3d w = inverse[i] * (p - vertices[tets[i][0]]);
      const std::array<double, 4> bary{1 - w.sum(), w[0], w[1], w[2]};
      const double least = *std::min_element(bary.begin(), bary.end());
      if (least > best_least) {
        best_least = least;
        best = {i, bary};
      }
    }
    result.push_back(best);
  }
  return result;
}

}  // namespace fulcrum::scene
