#include "physics_node/contact_model/sheet_place.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "physics_node/collision/closest.h"
#include "physics_node/simd/limits.h"
#include "services/base/core/sheets.h"

namespace fulcrum::physics {
namespace {

/// Most cells that a descent crosses: further than a point moves over the sheet in a step.
constexpr int kMaxDescent = 40;
/// Lines of the grid through a node, as (row, column) steps: along the row, the column and both diagonals.
constexpr std::array<std::pair<int, int>, 4> kLines{{{0, 1}, {1, 0}, {1, 1}, {1, -1}}};
/// Largest distance of a lip from a dead node whose position is interpolated from it [steps].
constexpr int kLipReach = 4;

}  // namespace

Vec3f SheetWalk::NodePlace(Index node) const {
  const auto cols = static_cast<int>(scene_.membrane.cols), rows = static_cast<int>(scene_.membrane.rows);
  const int row = static_cast<int>(node) / cols, col = static_cast<int>(node) % cols;
  const auto lives = [&](int r, int c) {
    if (r < 0 || c < 0 || r >= rows || c >= cols) {
      return false;
    }
    const auto other = static_cast<Index>(r * cols + c);
    return model_->NodeAlive(other) && !model_->IsDebris(other);
  };
  const auto at = [&](int r, int c) {
    return particles_->At(particles_->NodeRef(static_cast<Index>(r), static_cast<Index>(c)));
  };
  if (lives(row, col)) {
    return at(row, col);
  }
  // Linear interpolation from lip to lip along each line of the grid on which both are within reach; the mean over the
  // lines, weighted by 1 / distance of the lips.
  Vec3f sum = Vec3f::Zero();
  float weights = 0;
  for (const auto& [dr, dc] : kLines) {
    int before = 1, after = 1;
    while (before <= kLipReach && !lives(row - before * dr, col - before * dc)) {
      ++before;
    }
    while (after <= kLipReach && !lives(row + after * dr, col + after * dc)) {
      ++after;
    }
    if (before > kLipReach || after > kLipReach) {
      continue;
    }
    const float weight = 1.0f / static_cast<float>(before + after), share = static_cast<float>(before) * weight;
    sum += weight *
           ((1.0f - share) * at(row - before * dr, col - before * dc) + share * at(row + after * dr, col + after * dc));
    weights += weight;
  }
  if (weights == 0.0f) {
    for (int r = row - 1; r <= row + 1; ++r) {
      for (int c = col - 1; c <= col + 1; ++c) {
        if (lives(r, c)) {
          sum += at(r, c);
          weights += 1.0f;
        }
      }
    }
  }
  return weights > 0.0f ? Vec3f(sum / weights) : at(row, col);
}

Vec2f SheetWalk::MaterialAt(const std::array<Index, 3>& nodes, const std::array<float, 3>& barycentric) const {
  Vec2f place = Vec2f::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    place += barycentric[i] * scene_.membrane_material[nodes[i]];
  }
  return place;
}

/// visit(triangle, nodes, corners in frame W) for the triangles of a cell and of the eight around it.
template <class Visit>
void SheetWalk::ForTrianglesAround(Index cell, const Visit& visit) const {
  const Index cells = scene_.membrane.cols - 1, cell_rows = scene_.membrane.rows - 1;
  const Index row = cell / cells, col = cell % cells;
  const Index r0 = row > 0 ? row - 1 : 0, r1 = std::min(row + 1, cell_rows - 1);
  const Index c0 = col > 0 ? col - 1 : 0, c1 = std::min(col + 1, cells - 1);
  constexpr Index kSide = 4;  // Nodes along a side of the 3 x 3 cells.
  std::array<Vec3f, kSide * kSide> place;
  for (Index r = r0; r <= r1 + 1; ++r) {
    for (Index c = c0; c <= c1 + 1; ++c) {
      place[kSide * (r - r0) + (c - c0)] = NodePlace(r * scene_.membrane.cols + c);
    }
  }
  for (Index r = r0; r <= r1; ++r) {
    for (Index c = c0; c <= c1; ++c) {
      if (!HasCell(scene_, r, c)) continue;
      const Index n00 = r * scene_.membrane.cols + c, n10 = n00 + scene_.membrane.cols,
                  at = kSide * (r - r0) + (c - c0);
      const Index triangle = 2 * (r * cells + c);
      visit(triangle, std::array<Index, 3>{n00, n00 + 1, n10 + 1},
            std::array<Vec3f, 3>{place[at], place[at + 1], place[at + kSide + 1]});
      visit(triangle + 1, std::array<Index, 3>{n00, n10 + 1, n10},
            std::array<Vec3f, 3>{place[at], place[at + kSide + 1], place[at + kSide]});
    }
  }
}

SheetPlace SheetWalk::Nearest(const Vec3f& p_W, Index start_cell) const {
  SheetPlace best;
  float best_sq = kLargestFinite;
  Index cell = start_cell;
  for (int step = 0; step < kMaxDescent; ++step) {
    std::array<Index, 3> best_nodes{};
    bool nearer = false;
    ForTrianglesAround(cell, [&](Index triangle, const std::array<Index, 3>& nodes, const std::array<Vec3f, 3>& x) {
      const auto barycentric = ClosestOnTriangle(p_W, x[0], x[1], x[2]);
      const float distance_sq =
          (barycentric[0] * x[0] + barycentric[1] * x[1] + barycentric[2] * x[2] - p_W).squaredNorm();
      if (distance_sq < best_sq) {
        best_sq = distance_sq;
        best.triangle = triangle;
        best.barycentric = barycentric;
        best_nodes = nodes;
        nearer = true;
      }
    });
    if (!nearer) {
      break;
    }
    best.material = MaterialAt(best_nodes, best.barycentric);
    if (best.cell() == cell) {
      break;
    }
    cell = best.cell();
  }
  best.distance_m = std::sqrt(best_sq);
  return best;
}

float SheetWalk::DistanceToLiving(const Vec3f& p_W, Index cell) const {
  const Index cells = scene_.membrane.cols - 1, cell_rows = scene_.membrane.rows - 1;
  const Index row = cell / cells, col = cell % cells;
  float nearest_sq = std::numeric_limits<float>::infinity();
  for (Index r = row > 1 ? row - 2 : 0; r <= std::min(row + 2, cell_rows - 1); ++r) {
    for (Index c = col > 1 ? col - 2 : 0; c <= std::min(col + 2, cells - 1); ++c) {
      for (const Index triangle : {2 * (r * cells + c), 2 * (r * cells + c) + 1}) {
        if (!model_->TriangleAlive(triangle)) {
          continue;
        }
        const auto nodes = model_->TriangleNodes(triangle);
        const Vec3f x = NodePlace(nodes[0]), y = NodePlace(nodes[1]), z = NodePlace(nodes[2]);
        const auto b = ClosestOnTriangle(p_W, x, y, z);
        nearest_sq = std::min(nearest_sq, (b[0] * x + b[1] * y + b[2] * z - p_W).squaredNorm());
      }
    }
  }
  return std::sqrt(nearest_sq);
}

SheetPlace SheetWalk::Crossing(const Vec3f& a_W, const Vec3f& b_W, Index cell) const {
  SheetPlace crossing;
  ForTrianglesAround(cell, [&](Index triangle, const std::array<Index, 3>& nodes, const std::array<Vec3f, 3>& x) {
    if (crossing.found()) {
      return;
    }
    const ClosestPoints closest = ClosestSegmentTriangle(a_W, b_W, x[0], x[1], x[2]);
    if (closest.crosses) {
      crossing = {triangle, closest.barycentric, MaterialAt(nodes, closest.barycentric), 0.0f};
    }
  });
  return crossing;
}

SheetPlace SheetWalk::At(const Vec2f& material, Index cell) const {
  const auto lift = [](const Vec2f& v) { return Vec3f(v.x(), v.y(), 0.0f); };
  SheetPlace best;
  float nearest = kLargestFinite;
  ForTrianglesAround(cell, [&](Index triangle, const std::array<Index, 3>& nodes, const std::array<Vec3f, 3>&) {
    const auto& m = scene_.membrane_material;
    const auto barycentric = ClosestOnTriangle(lift(material), lift(m[nodes[0]]), lift(m[nodes[1]]), lift(m[nodes[2]]));
    const Vec2f place = MaterialAt(nodes, barycentric);
    const float distance = (place - material).squaredNorm();
    if (distance < nearest) {
      nearest = distance;
      best = {triangle, barycentric, place, 0.0f};
    }
  });
  return best;
}

}  // namespace fulcrum::physics
