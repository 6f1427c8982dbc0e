#include "render_node/geometry/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace fulcrum::render {

void MapEmbedded(std::span<const Tetrahedron> tets, std::span<const EmbeddedVertex> embedded,
                 std::span<const float> xyz, std::span<Vec3f> out) {
  for (std::size_t k = 0; k < embedded.size(); ++k) {
    const EmbeddedVertex& vertex = embedded[k];
    const Tetrahedron& tet = tets[vertex.tetrahedron];
    Vec3f sum = Vec3f::Zero();
    for (int j = 0; j < 4; ++j) {
      sum += vertex.barycentric[j] * PositionOf(xyz, tet[j]);
    }
    out[k] = sum;
  }
}

void ComputeNormals(std::span<const Vec3f> positions, std::span<const Triangle> triangles, std::span<Vec3f> normals) {
  std::fill(normals.begin(), normals.end(), Vec3f::Zero());
  for (const Triangle& t : triangles) {
    const Vec3f area = (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
    normals[t[0]] += area;
    normals[t[1]] += area;
    normals[t[2]] += area;
  }
  for (Vec3f& n : normals) {
    const float length = n.norm();
    if (length > 0) {
      n /= length;
    }
  }
}

std::array<float, 3> NearestBarycentric(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) {
    return {1, 0, 0};
  }
  const Vec3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) {
    return {0, 1, 0};
  }
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const float v = d1 / (d1 - d3);
    return {1 - v, v, 0};
  }
  const Vec3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) {
    return {0, 0, 1};
  }
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const float w = d2 / (d2 - d6);
    return {1 - w, 0, w};
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const float w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const float sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

NearestOnSurface::NearestOnSurface(std::span<const Vec3f> positions, std::span<const Triangle> triangles)
    : positions_(positions), triangles_(triangles) {
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max());
  Vec3f high = -low;
  double edge_sum = 0;
  std::vector<Vec3f> centres(triangles.size());
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const Vec3f &a = positions[triangles[k][0]], &b = positions[triangles[k][1]], &c = positions[triangles[k][2]];
    centres[k] = (a + b + c) / 3;
    low = low.cwiseMin(centres[k]);
    high = high.cwiseMax(centres[k]);
    edge_sum += ((b - a).norm() + (c - b).norm() + (a - c).norm()) / 3;
  }
  if (triangles.empty()) {
    low = high = Vec3f::Zero();
  }
  // Cells of two mean edge lengths hold a few triangles each. At most 64 cells per side bound the memory.
  const float extent = (high - low).maxCoeff();
  cell_ = std::max({static_cast<float>(2 * edge_sum / std::max<std::size_t>(1, triangles.size())), extent / 64, 1e-6f});
  origin_ = low;
  for (int d = 0; d < 3; ++d) {
    size_[d] = 1 + static_cast<int>((high[d] - low[d]) / cell_);
  }
  start_.assign(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2] + 1, 0);
  std::vector<std::size_t> cell_of(triangles.size());
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const auto cell = CellOf(centres[k]);
    cell_of[k] = CellIndex(cell[0], cell[1], cell[2]);
    ++start_[cell_of[k] + 1];
  }
  for (std::size_t c = 1; c < start_.size(); ++c) {
    start_[c] += start_[c - 1];
  }
  order_.resize(triangles.size());
  std::vector<Index> next(start_.begin(), start_.end() - 1);
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    order_[next[cell_of[k]]++] = static_cast<Index>(k);
  }
  for (const Index k : order_) {
    Ball ball{centres[k], 0};
    for (const Index v : triangles[k]) ball.radius = std::max(ball.radius, (positions[v] - centres[k]).norm());
    balls_.push_back(ball);
  }
}

std::array<int, 3> NearestOnSurface::CellOf(const Vec3f& point) const {
  std::array<int, 3> cell;
  for (int d = 0; d < 3; ++d) {
    cell[d] = std::clamp(static_cast<int>(std::floor((point[d] - origin_[d]) / cell_)), 0, size_[d] - 1);
  }
  return cell;
}

std::size_t NearestOnSurface::CellIndex(int x, int y, int z) const {
  return (static_cast<std::size_t>(z) * size_[1] + y) * size_[0] + x;
}

SurfacePoint NearestOnSurface::Find(const Vec3f& point) const {
  const auto centre = CellOf(point);
  SurfacePoint best{};
  float best_distance = std::numeric_limits<float>::max(), best_root = 1e18f;
  int last_ring = std::max({size_[0], size_[1], size_[2]});
  for (int ring = 0; ring <= last_ring; ++ring) {
    for (int z = std::max(0, centre[2] - ring); z <= std::min(size_[2] - 1, centre[2] + ring); ++z) {
      for (int y = std::max(0, centre[1] - ring); y <= std::min(size_[1] - 1, centre[1] + ring); ++y) {
        for (int x = std::max(0, centre[0] - ring); x <= std::min(size_[0] - 1, centre[0] + ring); ++x) {
          const int distance = std::max({std::abs(x - centre[0]), std::abs(y - centre[1]), std::abs(z - centre[2])});
          if (distance != ring) {
            continue;
          }
          const std::size_t cell = CellIndex(x, y, z);
          for (Index k = start_[cell]; k < start_[cell + 1]; ++k) {
            const float reach = best_root + balls_[k].radius;
            if ((balls_[k].centre - point).squaredNorm() > reach * reach) continue;
            const Triangle& t = triangles_[order_[k]];
            const Vec3f &a = positions_[t[0]], &b = positions_[t[1]], &c = positions_[t[2]];
            const auto w = NearestBarycentric(point, a, b, c);
            const float d = (w[0] * a + w[1] * b + w[2] * c - point).squaredNorm();
            if (d < best_distance) {
              best_distance = d;
              // The factor allows for rounding of roots and radii.
              best_root = 1.001f * std::sqrt(d);
              best = {t, w, order_[k]};
            }
          }
        }
      }
    }
    // One more ring after the first hit, because the centre of a nearer triangle may lie in the next ring.
    if (best_distance < std::numeric_limits<float>::max() && last_ring > ring + 1) {
      last_ring = ring + 1;
    }
  }
  return best;
}

}  // namespace fulcrum::render
