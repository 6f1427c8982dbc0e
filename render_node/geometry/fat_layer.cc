#include "render_node/geometry/fat_layer.h"

#include <algorithm>
#include <cmath>

#include "render_node/geometry/sheet_rim.h"
#include "services/base/core/sheets.h"

namespace fulcrum::render {
namespace {

// Depth of the fat under the membrane: kMostDepth where the tube is far away, never less than kLeastDepth, so that the
// two surfaces do not interfere in the depth test.
constexpr float kMostDepth = 0.0025f;   // [m]
constexpr float kLeastDepth = 0.0006f;  // [m]
constexpr float kThickFat = 0.004f;     // [m]
constexpr float kThinsToRim = 2.5f;     // Thickness by which fat recedes from a rim that is fused with the organ.
// Share of the membrane's lift beyond rest that the loose fat follows; the rest is opened areolar tissue.
constexpr float kFollow = 0.45f;

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
  positions_.resize(anchors_.size());
  normals_.resize(anchors_.size());
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
      Anchor anchor{node, nearest.Find(membrane), 0, 0};
      anchor.rest_gap = (membrane - anchor.foot.At(rest)).norm();
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
  for (Index r = 0; r + 1 < rows.size(); ++r) {
    for (Index c = 0; c + 1 < width; ++c) {
      const Index n00 = base + r * width + c;
      triangles_.push_back({n00, n00 + 1, n00 + width + 1});
      triangles_.push_back({n00, n00 + width + 1, n00 + width});
    }
  }
}

void FatLayer::Update(std::span<const float> xyz, const MembraneMesh& membrane) {
  for (std::size_t k = 0; k < anchors_.size(); ++k) {
    const Anchor& anchor = anchors_[k];
    const Vec3f foot = anchor.foot.At(xyz);
    const Vec3f up = membrane.positions()[anchor.node] - foot;
    const float gap = up.norm();
    const float lift = std::max(0.0f, gap - anchor.rest_gap);
    // Equals `weight` at rest and stays on the line from foot to membrane.
    const float weight =
        gap > 0 ? anchor.weight * (anchor.rest_gap + kFollow * lift) / std::max(gap, anchor.rest_gap) : 0;
    positions_[k] = foot + weight * up;
  }
  ComputeNormals(positions_, triangles_, normals_);
}

void FatLayer::FindBared(const std::function<bool(const Vec2f& material)>& opened, const MembraneMesh& membrane,
                         std::vector<float>* bared) const {
  bared->assign(anchors_.size(), 0.0f);
  for (std::size_t k = 0; k < anchors_.size(); ++k) {
    (*bared)[k] = opened(materials_[k]) || membrane.node_gone(anchors_[k].node) ? 1.0f : 0.0f;
  }
  for (const Triangle& t : triangles_) {
    if ((*bared)[t[0]] == 1 || (*bared)[t[1]] == 1 || (*bared)[t[2]] == 1) {
      for (const Index corner : t) {
        (*bared)[corner] = std::max((*bared)[corner], 0.5f);
      }
    }
  }
}

}  // namespace fulcrum::render
