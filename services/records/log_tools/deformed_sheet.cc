#include "services/records/log_tools/deformed_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "services/base/core/sheets.h"

namespace fulcrum::log_tools {
namespace {

/// Spacing of the sub-grid that is searched first [nodes].
constexpr int kStride = 4;
/// Largest stretch of a cell of that sub-grid.
constexpr float kStretch = 2;
/// Number of places along an edge at which its lip is searched.
constexpr int kLooksAlongEdge = 20;

/// Weights of the point of triangle abc that is nearest to p: Ericson, "Real-Time Collision Detection" (2005), 5.1.5.
std::array<float, 3> NearestWeights(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vec3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const float v = d1 / (d1 - d3);
    return {1 - v, v, 0};
  }
  const Vec3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
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

}  // namespace

DeformedSheet::DeformedSheet(const SceneView& scene)
    : scene_(scene),
      rows_(static_cast<int>(scene.membrane.rows)),
      cols_(static_cast<int>(scene.membrane.cols)),
      absent_(AbsentNodes(scene)),
      dead_(scene.membrane.node_count()),
      severed_(3 * scene.membrane.node_count()),
      place_(scene.membrane.node_count(), Vec3f::Zero()),
      cut_of_(scene.membrane.triangle_count(), -1) {
  // Largest distance of a place in a coarse cell from all of its corners.
  for (int row = 0; row < rows_; row += kStride) {
    for (int col = 0; col < cols_; col += kStride) {
      if (absent_[Node(row, col)] != 0) continue;
      const Vec2f a = scene.membrane_material[Node(row, col)];
      const Vec2f b =
          scene.membrane_material[Node(std::min(row + kStride, rows_ - 1), std::min(col + kStride, cols_ - 1))];
      coarse_reach_m_ = std::max(coarse_reach_m_, 0.5f * kStretch * (b - a).norm());
    }
  }
}

void DeformedSheet::SetTopology(std::span<const std::uint8_t> dead_nodes, std::span<const std::uint8_t> dead_edges) {
  const auto is_set = [](std::span<const std::uint8_t> bits, std::size_t i) {
    return (i >> 3) < bits.size() && TestBit(bits, i) ? std::uint8_t{1} : std::uint8_t{0};
  };
  dead_nodes_.clear();
  for (std::size_t i = 0; i < dead_.size(); ++i) {
    dead_[i] = is_set(dead_nodes, i);
    if (dead_[i] != 0) dead_nodes_.push_back(i);
  }
  for (std::size_t i = 0; i < severed_.size(); ++i) severed_[i] = is_set(dead_edges, i);
  const Held held{*this};
  const SlitSheet sheet(held);
  cut_triangles_.clear();
  for (Index triangle = 0; triangle < cut_of_.size(); ++triangle) {
    if (!HasTriangle(scene_, triangle)) continue;
    const TriangleParts parts = sheet.Parts(MembraneTriangleAt(scene_.membrane.cols, triangle));
    const bool whole = parts.count == 1 && parts.owned[0] == kAllCorners;
    cut_of_[triangle] = whole ? -1 : static_cast<std::int32_t>(cut_triangles_.size());
    if (!whole) cut_triangles_.push_back(triangle);
  }
}

void DeformedSheet::CutIntoPieces(const Removed& removed) {
  const Held held{*this};
  const SlitSheet sheet(held);
  const auto node = [&](Index n) { return Point{place_[n], held.Material(n)}; };
  // The lip: end of the tissue attached to `owner` along its edge to `other`.
  const auto lip = [&](Index owner, Index other) {
    const Vec2f from = held.Material(owner), way = held.Material(other) - from;
    int first = 0;
    while (first < kLooksAlongEdge && !removed(from + (static_cast<float>(first) + 0.5f) / kLooksAlongEdge * way)) {
      ++first;
    }
    // Patches come later than the topology: the lip of an edge without a known hole is placed at its middle.
    const float share = first < kLooksAlongEdge ? static_cast<float>(first) / kLooksAlongEdge : 0.5f;
    return Point{place_[owner] + share * (sheet.Ghost(owner, other) - place_[owner]), from + share * way};
  };
  const auto middle = [&](Index a, Index b) {
    return Point{0.5f * (place_[a] + place_[b]), 0.5f * (held.Material(a) + held.Material(b))};
  };
  pieces_.clear();
  first_piece_.clear();
  for (const Index triangle : cut_triangles_) {
    first_piece_.push_back(pieces_.size());
    const MembraneTriangle t = MembraneTriangleAt(scene_.membrane.cols, triangle);
    const auto& n = t.nodes;
    // Two points of each edge: the ends of the tissue attached to its first and to its second corner.
    std::array<std::array<Point, 2>, 3> end;
    std::size_t joined = 3;  // Index of the live edge, if there is one.
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = n[k], b = n[(k + 1) % 3];
      if (!held.Gone(a) && !held.Gone(b) && !held.Severed(t.edges[k])) {
        joined = k;
        end[k][0] = end[k][1] = middle(a, b);
        continue;
      }
      end[k][0] = held.Gone(a) ? node(a) : lip(a, b);
      end[k][1] = held.Gone(b) ? node(b) : lip(b, a);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      if (!held.Gone(n[k])) pieces_.push_back({node(n[k]), end[k][0], end[(k + 2) % 3][1]});
    }
    if (joined < 3) {
      const auto &left = end[(joined + 2) % 3], &right = end[(joined + 1) % 3];
      pieces_.push_back({end[joined][0], right[0], left[1]});
      pieces_.push_back({right[0], right[1], left[0]});
      pieces_.push_back({right[0], left[0], left[1]});
      continue;
    }
    // The gap is a hexagon.
    Point centre{Vec3f::Zero(), Vec2f::Zero()};
    for (const auto& edge : end) {
      for (const Point& point : edge) {
        centre.place += point.place / 6.0f;
        centre.material += point.material / 6.0f;
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      pieces_.push_back({centre, end[k][0], end[k][1]});
      pieces_.push_back({centre, end[k][1], end[(k + 1) % 3][0]});
    }
  }
  first_piece_.push_back(pieces_.size());
}

bool DeformedSheet::SetPositions(std::span<const float> xyz, const Removed& removed) {
  const std::size_t first = scene_.membrane.first;
  if (xyz.size() < 3 * (first + place_.size())) return false;
  for (std::size_t i = 0; i < place_.size(); ++i) place_[i] = Eigen::Map<const Vec3f>(&xyz[3 * (first + i)]);
  FillDeadNodes();
  CutIntoPieces(removed);
  return true;
}

void DeformedSheet::FillDeadNodes() {
  // From the edge of the hole inwards; a node whose neighbours are all unknown is postponed.
  std::vector<std::uint8_t> unknown = dead_;
  std::vector<std::size_t> open = dead_nodes_, later, filled;
  while (!open.empty()) {
    later.clear();
    filled.clear();
    for (const std::size_t node : open) {
      const int row = static_cast<int>(node) / cols_, col = static_cast<int>(node) % cols_;
      Vec3f sum = Vec3f::Zero();
      int count = 0;
      const auto add = [&](int r, int c) {
        if (r < 0 || c < 0 || r >= rows_ || c >= cols_ || unknown[Node(r, c)] != 0) return;
        sum += place_[Node(r, c)];
        ++count;
      };
      add(row - 1, col);
      add(row + 1, col);
      add(row, col - 1);
      add(row, col + 1);
      if (count == 0) {
        later.push_back(node);
        continue;
      }
      place_[node] = sum / static_cast<float>(count);
      filled.push_back(node);
    }
    if (filled.empty()) return;
    for (const std::size_t node : filled) unknown[node] = 0;
    open.swap(later);
  }
}

std::optional<DeformedSheet::Place> DeformedSheet::Nearest(const Vec3f& p_W, float within_m,
                                                           std::span<const float> skin_m) const {
  std::optional<Place> nearest;
  const auto gap = [&](const Place& place) { return place.distance_m - (skin_m.empty() ? 0.0f : skin_m[place.sheet]); };
  const std::vector<SheetPart> sheets = SheetsOf(scene_);
  for (std::size_t sheet = 0; sheet < sheets.size(); ++sheet) {
    std::optional<Place> place = NearestOn(sheets[sheet], p_W, within_m);
    if (!place) continue;
    place->sheet = sheet;
    if (!nearest || gap(*place) < gap(*nearest)) nearest = place;
  }
  return nearest;
}

std::optional<DeformedSheet::Place> DeformedSheet::NearestOn(const SheetPart& sheet, const Vec3f& p_W,
                                                             float within_m) const {
  const int first_row = static_cast<int>(sheet.first_row), end_row = first_row + static_cast<int>(sheet.rows);
  float coarse = std::numeric_limits<float>::infinity();
  int row = first_row, col = 0;
  for (int r = first_row; r < end_row; r += kStride) {
    for (int c = 0; c < static_cast<int>(sheet.cols); c += kStride) {
      const float squared = (place_[Node(r, c)] - p_W).squaredNorm();
      if (squared < coarse) {
        coarse = squared;
        row = r;
        col = c;
      }
    }
  }
  if (std::sqrt(coarse) > within_m + coarse_reach_m_) return std::nullopt;
  float best = std::numeric_limits<float>::infinity();
  Place place;
  // Searches a window of cells; if the nearest triangle lies at its border, the window moves there.
  for (int moves = 0; moves < 2 * (rows_ + cols_); ++moves) {
    const int row0 = std::max(0, row - kStride), row1 = std::min(rows_ - 1, row + kStride);
    const int col0 = std::max(0, col - kStride), col1 = std::min(cols_ - 1, col + kStride);
    int best_row = row, best_col = col;
    bool better = false;
    for (int r = row0; r < row1; ++r) {
      for (int c = col0; c < col1; ++c) {
        if (!HasCell(scene_, static_cast<Index>(r), static_cast<Index>(c))) continue;
        for (Index triangle = 2 * static_cast<Index>(r * (cols_ - 1) + c), end = triangle + 2; triangle < end;
             ++triangle) {
          const auto offer = [&](const std::array<Vec3f, 3>& x, const std::array<Vec2f, 3>& material) {
            const auto w = NearestWeights(p_W, x[0], x[1], x[2]);
            const float squared = (w[0] * x[0] + w[1] * x[1] + w[2] * x[2] - p_W).squaredNorm();
            if (!(squared < best)) return;
            best = squared;
            better = true;
            best_row = r;
            best_col = c;
            place.material = w[0] * material[0] + w[1] * material[1] + w[2] * material[2];
          };
          if (const std::int32_t cut = cut_of_[triangle]; cut >= 0) {
            const auto at = static_cast<std::size_t>(cut);
            for (std::size_t i = first_piece_[at]; i < first_piece_[at + 1]; ++i) {
              const Piece& piece = pieces_[i];
              offer({piece[0].place, piece[1].place, piece[2].place},
                    {piece[0].material, piece[1].material, piece[2].material});
            }
            continue;
          }
          const Triangle t = MembraneTriangleAt(scene_.membrane.cols, triangle).nodes;
          const auto& m = scene_.membrane_material;
          offer({place_[t[0]], place_[t[1]], place_[t[2]]}, {m[t[0]], m[t[1]], m[t[2]]});
        }
      }
    }
    const auto at_border = [](int at, int begin, int end, int all) {
      return (at == begin && begin > 0) || (at + 1 == end && end + 1 < all);
    };
    if (!better || (!at_border(best_row, row0, row1, rows_) && !at_border(best_col, col0, col1, cols_))) break;
    row = best_row;
    col = best_col;
  }
  place.distance_m = std::sqrt(best);
  if (!(place.distance_m <= within_m)) return std::nullopt;
  return place;
}

}  // namespace fulcrum::log_tools
