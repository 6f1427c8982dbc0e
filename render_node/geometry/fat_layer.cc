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
// Cells beside a cut within which fat may be bared: 12 mm in the built-in scene. Those of the membrane are searched
// farther away.
constexpr int kReach = 10, kSearched = 16;
constexpr int kFine = 2;  // Points a cell at which coverage is found.

/// Two sides of a triangle and their cross product, which turn with it.
Mat3f FrameOf(const Triangle& t, std::span<const float> xyz) {
  const Vec3f a = PositionOf(xyz, t[0]);
  Mat3f frame;
  frame.col(0) = PositionOf(xyz, t[1]) - a;
  frame.col(1) = PositionOf(xyz, t[2]) - a;
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

/// Marks the points of a raster within a triangle, its border included.
void MarkTriangle(const Vec2f& a, const Vec2f& b, const Vec2f& c, int width, int height,
                  std::vector<std::uint8_t>* raster) {
  const Vec2f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const int x0 = std::max(0, static_cast<int>(std::ceil(low.x() - 0.01f))),
            x1 = std::min(width - 1, static_cast<int>(high.x() + 0.01f));
  const int y0 = std::max(0, static_cast<int>(std::ceil(low.y() - 0.01f)));
  const int y1 = std::min(height - 1, static_cast<int>(high.y() + 0.01f));
  const auto cross = [](const Vec2f& u, const Vec2f& v) { return u.x() * v.y() - u.y() * v.x(); };
  const float area = cross(b - a, c - a);
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

void FatLayer::Update(std::span<const float> xyz, const MembraneMesh& membrane) {
  for (std::size_t k = 0; k < anchors_.size(); ++k) {
    feet_[k] = anchors_[k].foot.At(xyz);
    ups_[k] = (FrameOf(anchors_[k].foot.triangle, xyz) * anchors_[k].up).normalized();
  }
  std::fill(bared_.begin(), bared_.end(), 0.0f);
  for (const Grid& grid : grids_) {
    if (grid.any_cut) FindBared(grid, membrane);
  }
  for (std::size_t k = 0; k < anchors_.size(); ++k) {
    const Anchor& anchor = anchors_[k];
    const Vec3f& foot = feet_[k];
    const float height = anchor.weight * anchor.rest_gap;
    const Vec3f alone = foot + height * ups_[k];
    positions_[k] = alone;
    if (bared_[k] == 1) continue;
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
    positions_[k] = covered + bared_[k] * (alone - covered);
  }
  ComputeNormals(positions_, triangles_, normals_);
}

/// Finds over which cells of the grid each piece of the membrane lies now: a node's displacement from its place at
/// rest, carried by the tube, is expressed in cells; pieces that are not cut cover the points between their nodes.
void FatLayer::FindBared(const Grid& grid, const MembraneMesh& membrane) {
  int left = grid.cols, right = 0, low = grid.rows, high = 0;  // Vertices around all cuts.
  for (int r = 0; r + 1 < grid.rows; ++r) {
    for (int c = 0; c + 1 < grid.cols; ++c) {
      if (grid.cut[TexelIndex(c, r, grid.cols - 1)] == 0) continue;
      left = std::min(left, c);
      right = std::max(right, c + 1);
      low = std::min(low, r);
      high = std::max(high, r + 1);
    }
  }
  const auto within = [](int value, int count) { return std::clamp(value, 0, count - 1); };
  const int c0 = within(left - kReach, grid.cols), c1 = within(right + kReach, grid.cols);
  const int r0 = within(low - kReach, grid.rows), r1 = within(high + kReach, grid.rows);
  const int from_c = within(left - kSearched, grid.cols), to_c = within(right + kSearched, grid.cols);
  const int from_r = within(low - kSearched, grid.rows), to_r = within(high + kSearched, grid.rows);
  const auto vertex = [&grid](int c, int r) { return grid.first + TexelIndex(c, r, grid.cols); };
  const auto rest_place = [&](int c, int r) -> Vec3f {
    const std::size_t k = vertex(within(c, grid.cols), within(r, grid.rows));
    return feet_[k] + anchors_[k].rest_gap * ups_[k];
  };
  const int width = kFine * (c1 - c0) + 1, rows = kFine * (r1 - r0) + 1;
  over_.resize(static_cast<std::size_t>(grid.cols) * static_cast<std::size_t>(grid.rows));
  for (int r = from_r; r <= to_r; ++r) {
    for (int c = from_c; c <= to_c; ++c) {
      const Vec3f along = (rest_place(c + 1, r) - rest_place(c - 1, r)) /
                          static_cast<float>(within(c + 1, grid.cols) - within(c - 1, grid.cols));
      const Vec3f across = (rest_place(c, r + 1) - rest_place(c, r - 1)) /
                           static_cast<float>(within(r + 1, grid.rows) - within(r - 1, grid.rows));
      const Vec3f moved = membrane.positions()[anchors_[vertex(c, r)].node] - rest_place(c, r);
      const float aa = along.squaredNorm(), ab = along.dot(across), bb = across.squaredNorm();
      const float determinant = aa * bb - ab * ab;
      Vec2f cells = Vec2f::Zero();
      if (determinant > 0) {
        const float ma = moved.dot(along), mb = moved.dot(across);
        cells = Vec2f(bb * ma - ab * mb, aa * mb - ab * ma) / determinant;
      }
      // What continues the sheet covers the points beyond its rim.
      const auto beyond = [](int value, int count) { return value == 0 ? -2.0f : value == count - 1 ? 2.0f : 0.0f; };
      cells += Vec2f(beyond(c, grid.cols), beyond(r, grid.rows));
      over_[TexelIndex(c, r, grid.cols)] =
          kFine * (Vec2f(static_cast<float>(c - c0), static_cast<float>(r - r0)) + cells);
    }
  }
  covered_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows), 0);
  for (int r = from_r; r < to_r; ++r) {
    for (int c = from_c; c < to_c; ++c) {
      if (grid.cut[TexelIndex(c, r, grid.cols - 1)] != 0) continue;
      const auto over = [&](int dc, int dr) { return over_[TexelIndex(c + dc, r + dr, grid.cols)]; };
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
      bared_[vertex(c, r)] = std::min(1.0f, 2.0f * static_cast<float>(open) / static_cast<float>(all));
    }
  }
}

}  // namespace fulcrum::render
