#include "render_node/geometry/fat_layer.h"

#include <algorithm>
#include <cmath>

#include "render_node/geometry/sheet_rim.h"
#include "render_node/geometry/texel.h"
#include "services/base/core/sheets.h"

namespace fulcrum::render {
namespace {

// Depth of the fat under the membrane: kMostDepth where the tube is far away, never less than kLeastDepth, so that the
// two surfaces do not interfere in the depth test.
constexpr float kMostDepth = 0.0025f;   // [m]
constexpr float kLeastDepth = 0.0006f;  // [m]
constexpr float kThickFat = 0.004f;     // [m]
constexpr float kThinsToRim = 2.5f;     // Thickness by which fat recedes from a rim that is fused with the organ.
// The loose fat follows the membrane by this share of its lift beyond rest, and by no more than kMostFollow; the rest
// is opened areolar tissue.
constexpr float kFollow = 0.45f;
constexpr float kMostFollow = 0.002f;  // [m]
constexpr float kFlattest = 0.15f;     // Share of its height to which a membrane that is pressed down flattens the fat.
constexpr int kBeyond = 2;             // Cells around the openings within which fat may be bared,
constexpr int kSearched = 12;          // and around the cuts within which pieces of the membrane may lie over them.
constexpr float kFlattestSight = 0.5f;  // Sine of the least angle between line of sight and fat that is used.
constexpr int kFine = 2;                // Points a cell at which coverage is found.

/// Two sides of a triangle and their cross product, which turn with it.
Mat3f FrameOf(const Triangle& t, std::span<const float> xyz) {
  const Vec3f a = PositionOf(xyz, t[0]);
  Mat3f frame;
  frame.col(0) = PositionOf(xyz, t[1]) - a;
  frame.col(1) = PositionOf(xyz, t[2]) - a;
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

/// Unit vector along `normal` or against it, on the side of `up`.
Vec3f Outward(const Vec3f& normal, const Vec3f& up) { return (normal.dot(up) < 0 ? -normal : normal).normalized(); }

/// Marks the points of a raster within a triangle, its border included.
void MarkTriangle(const Vec2f& a, const Vec2f& b, const Vec2f& c, int width, int height,
                  std::vector<std::uint8_t>* raster) {
  const auto cross = [](const Vec2f& u, const Vec2f& v) { return u.x() * v.y() - u.y() * v.x(); };
  const float area = cross(b - a, c - a);
  if (!(std::abs(area) > 0.0f)) return;
  const Vec2f size(static_cast<float>(width), static_cast<float>(height));
  const Vec2f low = a.cwiseMin(b).cwiseMin(c).cwiseMax(0.0f).cwiseMin(size);
  const Vec2f high = a.cwiseMax(b).cwiseMax(c).cwiseMax(-1.0f).cwiseMin(size);
  const int x0 = static_cast<int>(std::ceil(low.x() - 0.01f)), y0 = static_cast<int>(std::ceil(low.y() - 0.01f));
  const int x1 = std::min(width - 1, static_cast<int>(std::floor(high.x() + 0.01f)));
  const int y1 = std::min(height - 1, static_cast<int>(std::floor(high.y() + 0.01f)));
  const float rounding = -1e-3f * area * area;  // Nodes at rest lie on points of the raster.
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const Vec2f p(static_cast<float>(x), static_cast<float>(y));
      const float first = cross(b - a, p - a) * area, second = cross(c - b, p - b) * area;
      if (first >= rounding && second >= rounding && cross(a - c, p - c) * area >= rounding) {
        (*raster)[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] = 1;
      }
    }
  }
}

}  // namespace

FatLayer::FatLayer(const SceneView& scene, std::uint32_t stride) {
  if (scene.tube_surface.empty() || scene.membrane.node_count() == 0) {
    return;
  }
  const NearestOnSurface nearest(scene.rest_position, scene.tube_surface);
  const std::vector<float> rim = SheetRim(scene);
  for (const SheetPart& sheet : SheetsOf(scene)) {
    if (sheet.over == kNoIndex) continue;
    const auto first = static_cast<std::ptrdiff_t>(anchors_.size());
    AddSheet(scene, sheet, stride, nearest);
    // Relative to the tenth percentile instead of the smallest gap, because single folds of the tube are close to the
    // membrane.
    std::vector<float> gaps;
    for (auto anchor = anchors_.begin() + first; anchor != anchors_.end(); ++anchor) gaps.push_back(anchor->rest_gap);
    const auto tenth = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 10);
    std::nth_element(gaps.begin(), tenth, gaps.end());
    for (auto anchor = anchors_.begin() + first; anchor != anchors_.end(); ++anchor) {
      thickness_.push_back(std::clamp((anchor->rest_gap - *tenth) / kThickFat, 0.0f, 1.0f) +
                           kThinsToRim * std::min(0.0f, rim[anchor->node]));
    }
  }
  node_cols_ = scene.membrane.cols;
  positions_.resize(anchors_.size());
  normals_.resize(anchors_.size());
  bared_.resize(anchors_.size());
  ups_.resize(anchors_.size());
  feet_.resize(anchors_.size());
}

void FatLayer::AddSheet(const SceneView& scene, const SheetPart& sheet, std::uint32_t stride,
                        const NearestOnSurface& nearest) {
  const MembraneGrid& grid = scene.membrane;
  std::vector<std::uint32_t> rows, cols;
  const auto pick = [stride](std::uint32_t first, std::uint32_t count, std::vector<std::uint32_t>* out) {
    for (std::uint32_t i = 0; i < count - 1; i += stride) {
      out->push_back(first + i);
    }
    out->push_back(first + count - 1);
  };
  pick(sheet.first_row, sheet.rows, &rows);
  pick(0, sheet.cols, &cols);
  const std::span<const float> rest(scene.rest_position.front().data(), 3 * scene.rest_position.size());
  const auto base = static_cast<Index>(anchors_.size());
  for (const std::uint32_t row : rows) {
    for (const std::uint32_t col : cols) {
      const Index node = row * grid.cols + col;
      const Vec3f& membrane = scene.rest_position[grid.first + node];
      Anchor anchor{node, nearest.Find(membrane), Vec3f::Zero(), 0, 0};
      const Vec3f up = membrane - anchor.foot.At(rest);
      anchor.rest_gap = up.norm();
      const Mat3f frame = FrameOf(anchor.foot.triangle, rest);
      anchor.up = frame.inverse() * (anchor.rest_gap > 0 ? up : Vec3f(frame.col(2)));
      // Lobules: the depth below the membrane varies smoothly with the place.
      const Vec2f m = scene.membrane_material[node];
      const float wave =
          0.5f + 0.25f * std::sin(900 * m.x() + 300 * m.y()) + 0.25f * std::sin(700 * m.y() - 500 * m.x());
      const float depth = std::min(std::max(kLeastDepth, (0.3f + 0.3f * wave) * anchor.rest_gap), kMostDepth);
      anchor.weight = anchor.rest_gap > 0 ? std::max(0.0f, 1 - depth / anchor.rest_gap) : 0;
      anchors_.push_back(anchor);
      materials_.push_back(m);
    }
  }
  const auto width = static_cast<Index>(cols.size());
  const std::size_t cells = (rows.size() - 1) * (cols.size() - 1);
  grids_.push_back({base, static_cast<int>(rows.size()), static_cast<int>(cols.size()), rows, cols,
                    std::vector<std::uint8_t>(cells, 0), false});
  for (Index r = 0; r + 1 < rows.size(); ++r) {
    for (Index c = 0; c + 1 < width; ++c) {
      const Index n00 = base + r * width + c;
      triangles_.push_back({n00, n00 + 1, n00 + width + 1});
      triangles_.push_back({n00, n00 + width + 1, n00 + width});
    }
  }
}

void FatLayer::FindCuts(const MembraneMesh& membrane) {
  for (Grid& grid : grids_) {
    grid.any_cut = false;
    for (int r = 0; r + 1 < grid.rows; ++r) {
      for (int c = 0; c + 1 < grid.cols; ++c) {
        const std::uint32_t last_row = grid.node_rows[r + 1], last_col = grid.node_cols[c + 1];
        bool cut = false;
        for (std::uint32_t row = grid.node_rows[r]; row <= last_row; ++row) {
          for (std::uint32_t col = grid.node_cols[c]; col <= last_col; ++col) {
            const Index node = row * node_cols_ + col;
            cut |= membrane.node_gone(node) || (col < last_col && membrane.edge_severed(node, 0)) ||
                   (row < last_row && membrane.edge_severed(node, 1)) ||
                   (row < last_row && col < last_col && membrane.edge_severed(node, 2));
          }
        }
        grid.cut[TexelIndex(c, r, grid.cols - 1)] = cut ? 1 : 0;
        grid.any_cut |= cut;
      }
    }
  }
}

void FatLayer::Update(std::span<const float> xyz, const MembraneMesh& membrane, const Vec3f& eye_W) {
  for (std::size_t k = 0; k < anchors_.size(); ++k) {
    feet_[k] = anchors_[k].foot.At(xyz);
    ups_[k] = (FrameOf(anchors_[k].foot.triangle, xyz) * anchors_[k].up).normalized();
  }
  uncovered_.assign(anchors_.size(), 0.0f);
  for (const Grid& grid : grids_) {
    if (grid.any_cut) FindBared(grid, membrane, nullptr, &uncovered_);
  }
  bared_ = uncovered_;
  for (const Grid& grid : grids_) {
    if (grid.any_cut) FindBared(grid, membrane, &eye_W, &bared_);
  }
  for (std::size_t k = 0; k < anchors_.size(); ++k) {
    const Anchor& anchor = anchors_[k];
    const Vec3f& foot = feet_[k];
    const float height = anchor.weight * anchor.rest_gap;
    const Vec3f alone = foot + height * ups_[k];
    positions_[k] = alone;
    if (uncovered_[k] == 1) continue;
    const Vec3f up = membrane.positions()[anchor.node] - foot;
    const float gap = up.norm();
    const float lift = std::max(0.0f, gap - anchor.rest_gap);
    // Equals `weight` at rest and stays on the line from foot to membrane.
    const float weight =
        gap > 0 ? anchor.weight * (anchor.rest_gap + kFollow * lift) / std::max(gap, anchor.rest_gap) : 0;
    const float pressed = anchor.rest_gap > 0 ? std::clamp(up.dot(ups_[k]) / anchor.rest_gap, kFlattest, 1.0f) : 1;
    const Vec3f beneath = foot + pressed * height * ups_[k];
    const Vec3f offset = foot + weight * up - beneath;
    const Vec3f covered = beneath + std::min(1.0f, kMostFollow / std::max(offset.norm(), kMostFollow)) * offset;
    positions_[k] = covered + uncovered_[k] * (alone - covered);
  }
  ComputeNormals(positions_, triangles_, normals_);
}

/// Finds which points of the grid the membrane covers or, with an eye, hides from it: a node's displacement from its
/// place at rest, carried by the tube, is followed along the normal or the line of sight onto the fat and expressed in
/// cells; pieces that are not cut cover the points between their nodes.
void FatLayer::FindBared(const Grid& grid, const MembraneMesh& membrane, const Vec3f* eye_W,
                         std::vector<float>* bared) {
  int left = grid.cols, right = 0, low = grid.rows, high = 0;  // Vertices around all cuts.
  const auto cut = [&grid](int c, int r) { return grid.cut[TexelIndex(c, r, grid.cols - 1)] != 0; };
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.cols; ++c) {
      if (!cut(c, r)) continue;
      left = std::min(left, c);
      right = std::max(right, c + 1);
      low = std::min(low, r);
      high = std::max(high, r + 1);
    }
  }
  const auto within = [](int value, int count) { return std::clamp(value, 0, count - 1); };
  const int from_c = within(left - kSearched, grid.cols), to_c = within(right + kSearched, grid.cols);
  const int from_r = within(low - kSearched, grid.rows), to_r = within(high + kSearched, grid.rows);
  over_.resize(static_cast<std::size_t>(grid.cols) * static_cast<std::size_t>(grid.rows));
  for (int r = from_r; r <= to_r; ++r) {
    for (int c = from_c; c <= to_c; ++c) over_[TexelIndex(c, r, grid.cols)] = PlaceOver(grid, c, r, membrane, eye_W);
  }
  Vec2f least = Vec2f::Constant(1e9f), most = -least;  // Of the openings.
  for (int r = low; r < high; ++r) {
    for (int c = left; c < right; ++c) {
      for (int k = 0; cut(c, r) && k < 4; ++k) {
        const Vec2f& corner = over_[TexelIndex(c + k % 2, r + k / 2, grid.cols)];
        least = least.cwiseMin(corner);
        most = most.cwiseMax(corner);
      }
    }
  }
  // Beyond the pieces that are looked at nothing is known to be open.
  const auto cell = [](float value, int low_cell, int high_cell) {
    return static_cast<int>(std::clamp(value, static_cast<float>(low_cell), static_cast<float>(high_cell)));
  };
  const int c0 = cell(least.x() - kBeyond, from_c, to_c), c1 = cell(most.x() + kBeyond, from_c, to_c);
  const int r0 = cell(least.y() - kBeyond, from_r, to_r), r1 = cell(most.y() + kBeyond, from_r, to_r);
  const int width = kFine * (c1 - c0) + 1, rows = kFine * (r1 - r0) + 1;
  covered_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows), 0);
  const Vec2f origin(static_cast<float>(c0), static_cast<float>(r0));
  for (int r = from_r; r < to_r; ++r) {
    for (int c = from_c; c < to_c; ++c) {
      if (cut(c, r)) continue;
      const auto over = [&](int dc, int dr) -> Vec2f {
        return kFine * (over_[TexelIndex(c + dc, r + dr, grid.cols)] - origin);
      };
      MarkTriangle(over(0, 0), over(1, 0), over(1, 1), width, rows, &covered_);
      MarkTriangle(over(0, 0), over(1, 1), over(0, 1), width, rows, &covered_);
    }
  }
  for (int r = r0; r <= r1; ++r) {
    for (int c = c0; c <= c1; ++c) {
      int open = 0, all = 0;
      const int u = kFine * (c - c0), v = kFine * (r - r0);
      for (int y = std::max(0, v - 1); y <= std::min(rows - 1, v + 1); ++y) {
        for (int x = std::max(0, u - 1); x <= std::min(width - 1, u + 1); ++x) {
          open += covered_[TexelIndex(x, y, width)] == 0 ? 1 : 0;
          ++all;
        }
      }
      // Full where half of the points up to half a cell away are open.
      float& share = (*bared)[grid.first + TexelIndex(c, r, grid.cols)];
      share = std::max(share, std::min(1.0f, 2.0f * static_cast<float>(open) / static_cast<float>(all)));
    }
  }
}

Vec2f FatLayer::PlaceOver(const Grid& grid, int c, int r, const MembraneMesh& membrane, const Vec3f* eye_W) const {
  const int west = std::max(c - 1, 0), east = std::min(c + 1, grid.cols - 1);
  const int south = std::max(r - 1, 0), north = std::min(r + 1, grid.rows - 1);
  const auto rest_place = [&](int column, int row) -> Vec3f {
    const std::size_t k = grid.first + TexelIndex(column, row, grid.cols);
    return feet_[k] + anchors_[k].rest_gap * ups_[k];
  };
  const Vec3f along = (rest_place(east, r) - rest_place(west, r)) / static_cast<float>(east - west);
  const Vec3f across = (rest_place(c, north) - rest_place(c, south)) / static_cast<float>(north - south);
  const std::size_t k = grid.first + TexelIndex(c, r, grid.cols);
  const Vec3f& node = membrane.positions()[anchors_[k].node];
  Vec3f moved = node - rest_place(c, r);
  if (eye_W != nullptr) {
    const Vec3f normal = Outward(along.cross(across), ups_[k]);
    const float height = moved.dot(normal) + (1 - anchors_[k].weight) * anchors_[k].rest_gap;  // Above the fat.
    const Vec3f sight = (node - *eye_W).normalized();
    const float facing = -sight.dot(normal);
    // Only the part along the fat counts below.
    moved += std::max(0.0f, height) / std::max(facing, kFlattestSight) * sight;
  }
  const float aa = along.squaredNorm(), ab = along.dot(across), bb = across.squaredNorm();
  const float determinant = aa * bb - ab * ab;
  Vec2f place(static_cast<float>(c), static_cast<float>(r));
  if (determinant > 0) {
    const float ma = moved.dot(along), mb = moved.dot(across);
    place += Vec2f(bb * ma - ab * mb, aa * mb - ab * ma) / determinant;
  }
  // What continues the sheet hides the points beyond its rim.
  const auto beyond = [](int value, int count) { return value == 0 ? -2.0f : value == count - 1 ? 2.0f : 0.0f; };
  return place + Vec2f(beyond(c, grid.cols), beyond(r, grid.rows));
}

}  // namespace fulcrum::render
