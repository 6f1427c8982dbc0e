#include "render_node/geometry/solid_burn.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "render_node/geometry/texel.h"
#include "services/base/core/solids.h"

namespace fulcrum::render {
namespace {

constexpr int kRoundedTo = 16;  // [texels] Size of the atlas.
// Below these values (of 255) burn.frag shows nothing.
constexpr std::uint8_t kVisibleDamage = 8, kVisibleDryness = 2;
// The drawn surface lies within this distance of the simulated one [m], several times that of the built-in scene.
constexpr float kSurfacesApart = 0.003f;
// Least cosine between the normals of a drawn triangle and of its chart: 80 degrees. Steeper ones would be covered by a
// few stretched texels, and beyond 90 degrees by those of another place.
constexpr float kSteepestFacing = 0.17f;
constexpr Index kNotSearched = kNoIndex - 1;

AtlasRect Intersection(const AtlasRect& a, const AtlasRect& b) {
  const int left = std::max(a.x, b.x), low = std::max(a.y, b.y);
  return {left, low, std::min(a.x + a.width, b.x + b.width) - left, std::min(a.y + a.height, b.y + b.height) - low};
}

}  // namespace

BurnAtlas::BurnAtlas(const SolidCharts& charts, float body_temperature_C) {
  const auto rounded = [](std::int32_t texels) { return (texels + kRoundedTo - 1) / kRoundedTo * kRoundedTo; };
  width_ = rounded(charts.width);
  height_ = rounded(charts.height);
  intact_ = {TemperatureByte(body_temperature_C), 0, 0, 255};
  texels_.resize(4 * static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (std::size_t i = 0; i < texels_.size(); i += 4) std::memcpy(texels_.data() + i, intact_.data(), 4);
  for (const SolidChart& chart : charts.charts) boxes_.push_back({chart.x, chart.y, chart.width, chart.height});
}

AtlasRect BurnAtlas::Copy(const TemperaturePatch& patch) {
  const int x = static_cast<int>(patch.header.origin_x), y = static_cast<int>(patch.header.origin_y);
  const AtlasRect rect = Intersection({x, y, kPatchTexels, kPatchTexels}, {0, 0, width_, height_});
  if (rect.empty()) return {};
  for (int row = 0; row < rect.height; ++row) {
    std::memcpy(texels_.data() + 4 * TexelIndex(x, y + row, width_),
                patch.texels.data() + 4 * TexelIndex(0, row, kPatchTexels), 4 * static_cast<std::size_t>(rect.width));
  }
  return rect;
}

BurnCharts::BurnCharts(const BurnAtlas& atlas, std::span<const Index> charts)
    : intact_(atlas.intact()), boxes_(atlas.boxes().size()), first_(boxes_.size()) {
  for (const Index chart : charts) {
    const AtlasRect& box = boxes_[chart] = atlas.boxes()[chart];
    first_[chart] = texels_.size();
    if (box.empty()) continue;
    const auto width = static_cast<std::size_t>(box.width);
    texels_.resize(texels_.size() + width * static_cast<std::size_t>(box.height));
    BurnAtlas::Texel* to = texels_.data() + first_[chart];
    for (int y = box.y; y < box.y + box.height; ++y, to += width) {
      std::memcpy(to, atlas.texels().data() + 4 * TexelIndex(box.x, y, atlas.width()), 4 * width);
    }
  }
}

std::optional<BurnAtlas::Texel> BurnCharts::At(Index chart, const Vec2f& material) const {
  if (chart >= boxes_.size()) return std::nullopt;
  const AtlasRect& box = boxes_[chart];
  const int x = static_cast<int>(std::floor(material.x() / kSolidCell_m)) - box.x;
  const int y = static_cast<int>(std::floor(material.y() / kSolidCell_m)) - box.y;
  if (x < 0 || y < 0 || x >= box.width || y >= box.height) return std::nullopt;
  return texels_[first_[chart] + TexelIndex(x, y, box.width)];
}

AtlasRect SolidBurn::Apply(const TemperaturePatch& patch) {
  if (patch.header.surface != BurntSurface::kSolids || patch.texels.size() != 4u * kPatchTexels * kPatchTexels ||
      patch.header.origin_x >= kAtlasTexels || patch.header.origin_y >= kAtlasTexels) {
    return {};
  }
  if (!charts_) Prepare();
  const AtlasRect rect = atlas_.Copy(patch);
  if (rect.empty()) return {};
  for (Index i = 0; i < added_.size(); ++i) {
    if (added_[i] == 0 && ShowsBurn(Intersection(rect, atlas_.boxes()[i]))) AddChart(i);
  }
  return rect;
}

void SolidBurn::Prepare() {
  charts_ = MakeSolidCharts(scene_);
  atlas_ = BurnAtlas(*charts_, scene_.thermal.body_temperature_C);
  added_.assign(charts_->charts.size(), 0);
  rest_.resize(scene_.surface_vertices.size());
  chart_of_.assign(rest_.size(), kNotSearched);
  if (!rest_.empty()) {
    const std::span<const float> xyz(scene_.rest_position.front().data(), 3 * scene_.rest_position.size());
    MapEmbedded(scene_.tets, scene_.surface_vertices, xyz, rest_);
  }
  solid_of_ = SolidOfVertices(scene_);
  bodies_.resize(SolidCount(scene_));
}

bool SolidBurn::ShowsBurn(const AtlasRect& rect) const {
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      const std::uint8_t* texel = atlas_.texels().data() + 4 * TexelIndex(x, y, atlas_.width());
      if (texel[1] >= kVisibleDamage || texel[2] >= kVisibleDryness || texel[3] < 128) return true;
    }
  }
  return false;
}

SolidBurn::Body& SolidBurn::BodyWith(Index particle) {
  const Index solid = solid_of_[particle];
  std::unique_ptr<Body>& body = bodies_[solid];
  if (body) return *body;
  body = std::make_unique<Body>();
  body->drawn = scene_.surface_triangles;
  if (!scene_.solids.empty()) {
    const auto& own = scene_.solids[solid];
    body->drawn = body->drawn.subspan(own.first_surface_triangle, own.surface_triangle_count);
  }
  for (Index t = 0; t < scene_.tube_surface.size(); ++t) {
    if (solid_of_[scene_.tube_surface[t][0]] != solid) continue;
    body->simulated.push_back(scene_.tube_surface[t]);
    body->numbers.push_back(t);
  }
  body->nearest.emplace(scene_.rest_position, body->simulated);
  return *body;
}

Index SolidBurn::ChartAt(const Body& body, const Vec3f& rest) const {
  return charts_->of_triangle[body.numbers[body.nearest->Find(rest).number]];
}

Index SolidBurn::ChartOfVertex(const Body& body, Index vertex) {
  Index& chart = chart_of_[vertex];
  if (chart == kNotSearched) chart = ChartAt(body, rest_[vertex]);
  return chart;
}

void SolidBurn::AddChart(Index index) {
  added_[index] = 1;
  const SolidChart& chart = charts_->charts[index];
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max()), high = -low;
  Index particle = kNoIndex;
  for (std::size_t t = 0; t < scene_.tube_surface.size(); ++t) {
    if (charts_->of_triangle[t] != index) continue;
    for (const Index v : scene_.tube_surface[t]) {
      low = low.cwiseMin(scene_.rest_position[v]);
      high = high.cwiseMax(scene_.rest_position[v]);
      particle = v;
    }
  }
  if (particle == kNoIndex) return;
  low.array() -= kSurfacesApart;
  high.array() += kSurfacesApart;
  Body& body = BodyWith(particle);
  const std::array<float, 4> box{kSolidCell_m * static_cast<float>(chart.x), kSolidCell_m * static_cast<float>(chart.y),
                                 kSolidCell_m * static_cast<float>(chart.x + chart.width),
                                 kSolidCell_m * static_cast<float>(chart.y + chart.height)};
  std::vector<Index> corner_of(rest_.size(), kNoIndex);
  const std::size_t before = triangles_.size();
  for (const Triangle& t : body.drawn) {
    const Vec3f &a = rest_[t[0]], &b = rest_[t[1]], &c = rest_[t[2]];
    const Vec3f centroid = (a + b + c) / 3;
    if ((centroid.array() < low.array()).any() || (centroid.array() > high.array()).any()) continue;
    const Vec3f area = (b - a).cross(c - a);
    if (area.dot(chart.normal()) < kSteepestFacing * area.norm()) continue;
    // Over the border of two charts each shows its own part.
    const auto is_here = [&](Index v) { return ChartOfVertex(body, v) == index; };
    if (!std::any_of(t.begin(), t.end(), is_here) && ChartAt(body, centroid) != index) continue;
    Triangle& added = triangles_.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      Index& corner = corner_of[t[k]];
      if (corner == kNoIndex) {
        corner = static_cast<Index>(vertices_.size());
        vertices_.push_back(t[k]);
        materials_.push_back(chart.Material(rest_[t[k]]));
        chart_of_corner_.push_back(index);
        boxes_.push_back(box);
      }
      added[k] = corner;
    }
  }
  if (triangles_.size() != before) ++additions_;
}

}  // namespace fulcrum::render
