#include "services/base/core/solid_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "services/base/core/solids.h"

namespace fulcrum {
namespace {

constexpr float kLeastCosine = 0.643f;  ///< Of the angle between a triangle's normal and its chart's: 50 degrees.
constexpr float kMostExtent_m = 0.04f;  ///< Of a chart along either axis.
constexpr std::int32_t kBetween = 2;    ///< Texels around a chart.
constexpr float kCover_m = 8e-4f;       ///< Cell in which a chart is kept from lying over itself; finer takes longer.

/// By triangle and side (corners k, k + 1): the triangle beyond; kNoIndex at a border.
std::vector<std::array<Index, 3>> Neighbours(std::span<const Triangle> triangles) {
  struct Side {
    std::uint64_t edge;
    Index triangle, side;
  };
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (Index t = 0; t < triangles.size(); ++t) {
    for (Index k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
      sides.push_back({std::uint64_t{a} << 32 | b, t, k});
    }
  }
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return std::pair(a.edge, a.triangle) < std::pair(b.edge, b.triangle); });
  std::vector<std::array<Index, 3>> beyond(triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
  for (std::size_t n = 0; n + 1 < sides.size(); ++n) {
    const Side &a = sides[n], &b = sides[n + 1];
    if (a.edge != b.edge) continue;
    beyond[a.triangle][a.side] = b.triangle;
    beyond[b.triangle][b.side] = a.triangle;
  }
  return beyond;
}

struct Box {
  Vec2f low = Vec2f::Constant(1e9f), high = Vec2f::Constant(-1e9f);
  [[nodiscard]] Box With(const Vec2f& p) const { return {low.cwiseMin(p), high.cwiseMax(p)}; }
  [[nodiscard]] Vec2f extent() const { return high - low; }
};

class Cutter {
 public:
  explicit Cutter(const TissueScene& scene)
      : scene_(scene),
        triangles_(scene.tube_surface),
        beyond_(Neighbours(triangles_)),
        solid_of_(SolidOfVertices(scene)) {
    for (const Triangle& t : triangles_) {
      const Vec3f normal = (At(t[1]) - At(t[0])).cross(At(t[2]) - At(t[0]));
      areas_.push_back(normal);  // Of twice the area.
      normals_.push_back(normal.stableNormalized());
    }
  }

  /// Grows a chart from each triangle that has none yet: once to find the mean normal, then along it.
  SolidCharts Cut() {
    SolidCharts result;
    result.of_triangle.assign(triangles_.size(), kNoIndex);
    for (Index seed = 0; seed < triangles_.size(); ++seed) {
      if (result.of_triangle[seed] != kNoIndex) continue;
      std::vector<Index> part = Grow(seed, normals_[seed], result.of_triangle, false).second;
      Vec3f mean = Vec3f::Zero();
      for (const Index t : part) mean += areas_[t];
      // The seed itself must be part of its chart.
      if (normals_[seed].dot(mean.stableNormalized()) < kLeastCosine) mean = areas_[seed];
      auto [chart, own] = Grow(seed, mean.stableNormalized(), result.of_triangle, true);
      for (const Index t : own) result.of_triangle[t] = static_cast<Index>(result.charts.size());
      const Index vertex = triangles_[seed][0];
      chart.solid = vertex < solid_of_.size() ? solid_of_[vertex] : 0;
      result.charts.push_back(chart);
    }
    return result;
  }

 private:
  [[nodiscard]] const Vec3f& At(Index vertex) const { return scene_.rest_position[vertex]; }

  std::pair<SolidChart, std::vector<Index>> Grow(Index seed, const Vec3f& normal, const std::vector<Index>& taken,
                                                 bool once) {
    SolidChart chart;
    const Vec3f n = normal.isZero() ? Vec3f(Vec3f::UnitZ()) : normal;
    chart.s_axis = n.unitOrthogonal();
    chart.t_axis = n.cross(chart.s_axis);
    ++stamp_;
    std::vector<Index> part{seed};
    seen_[seed] = stamp_;
    const Vec2f middle = Projected(chart, triangles_[seed][0]);
    if (once) (void)Cover(chart, middle, seed);
    Box box = With(Box{}, chart, seed);
    for (std::size_t next = 0; next < part.size(); ++next) {
      for (const Index t : beyond_[part[next]]) {
        if (t == kNoIndex || seen_[t] == stamp_ || taken[t] != kNoIndex || normals_[t].dot(n) < kLeastCosine) continue;
        seen_[t] = stamp_;
        const Box larger = With(box, chart, t);
        if (larger.extent().maxCoeff() > kMostExtent_m || (once && !Cover(chart, middle, t))) continue;
        box = larger;
        part.push_back(t);
      }
    }
    chart.shift = -box.low;
    const auto texels = [](float length) { return static_cast<std::int32_t>(std::ceil(length / kSolidCell_m)) + 1; };
    chart.width = texels(box.extent().x());
    chart.height = texels(box.extent().y());
    return {chart, std::move(part)};
  }
  [[nodiscard]] Vec2f Projected(const SolidChart& chart, Index vertex) const {
    return {chart.s_axis.dot(At(vertex)), chart.t_axis.dot(At(vertex))};
  }
  [[nodiscard]] Box With(Box box, const SolidChart& chart, Index triangle) const {
    for (const Index v : triangles_[triangle]) box = box.With(Projected(chart, v));
    return box;
  }
  /// Takes the cells (of kCover_m) of a triangle, those with their middle well inside. Returns false, and takes none,
  /// if one is taken: there the surface lies over another part of its chart.
  bool Cover(const SolidChart& chart, const Vec2f& middle, Index triangle) {
    std::array<Vec2f, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2f from_middle = Projected(chart, triangles_[triangle][k]) - middle;
      p[k] = from_middle / kCover_m + Vec2f::Constant(0.5f * kCoverCells);
    }
    const Vec2f low = p[0].cwiseMin(p[1]).cwiseMin(p[2]), high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    const Vec2f e1 = p[1] - p[0], e2 = p[2] - p[0];
    const float area = e1.x() * e2.y() - e1.y() * e2.x();
    if (!(std::abs(area) > 0.0f)) return true;
    cells_.clear();
    for (int y = std::max(0, static_cast<int>(low.y())); y <= std::min(high.y(), kCoverCells - 1.0f); ++y) {
      for (int x = std::max(0, static_cast<int>(low.x())); x <= std::min(high.x(), kCoverCells - 1.0f); ++x) {
        const Vec2f d = Vec2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - p[0];
        const float u = (d.x() * e2.y() - d.y() * e2.x()) / area, v = (e1.x() * d.y() - e1.y() * d.x()) / area;
        constexpr float kInside = 1e-3f;
        if (u < kInside || v < kInside || u + v > 1 - kInside) continue;
        const std::size_t cell = static_cast<std::size_t>(y) * kCoverCells + static_cast<std::size_t>(x);
        if (covered_[cell] == stamp_) return false;
        cells_.push_back(cell);
      }
    }
    for (const std::size_t cell : cells_) covered_[cell] = stamp_;
    return true;
  }

  /// Edge of the square of cells around a seed that its chart can reach.
  static constexpr int kCoverCells = 2 * static_cast<int>(kMostExtent_m / kCover_m) + 4;

  const TissueScene& scene_;
  std::span<const Triangle> triangles_;
  std::vector<std::array<Index, 3>> beyond_;
  std::vector<Index> solid_of_;  ///< By vertex.
  std::vector<Vec3f> areas_, normals_;
  // By triangle, and by cell of the square: the number of the growth that has seen or covered it.
  std::vector<std::uint32_t> seen_ = std::vector<std::uint32_t>(triangles_.size(), 0);
  std::vector<std::uint32_t> covered_ = std::vector<std::uint32_t>(std::size_t{kCoverCells} * kCoverCells, 0);
  std::uint32_t stamp_ = 0;
  std::vector<std::size_t> cells_;  ///< Scratch.
};

/// Puts the charts into rows, the tallest first. Those that do not fit lose their triangles.
void Pack(SolidCharts* all) {
  std::vector<SolidChart>& charts = all->charts;
  std::vector<Index> order(charts.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return charts[a].height > charts[b].height; });
  double area = 0;
  std::int32_t widest = 0;
  for (const SolidChart& chart : charts) {
    area += static_cast<double>(chart.width + 2 * kBetween) * static_cast<double>(chart.height + 2 * kBetween);
    widest = std::max(widest, chart.width + 2 * kBetween);
  }
  const auto square = static_cast<std::int32_t>(std::ceil(std::sqrt(1.1 * area)));
  const std::int32_t limit = std::min(std::max(square, widest), kAtlasTexels);
  std::int32_t x = 0, y = 0, tallest = 0;
  std::vector<std::uint8_t> left_out(charts.size(), 0);
  for (const Index index : order) {
    SolidChart& chart = charts[index];
    const std::int32_t width = chart.width + 2 * kBetween, height = chart.height + 2 * kBetween;
    if (x + width > limit) {
      x = 0;
      y += tallest;
      tallest = 0;
    }
    left_out[index] = y + height > kAtlasTexels || width > kAtlasTexels ? 1 : 0;
    if (left_out[index] != 0) {
      chart.width = chart.height = 0;
      continue;
    }
    chart.x = x + kBetween;
    chart.y = y + kBetween;
    chart.shift += kSolidCell_m * Vec2f(static_cast<float>(chart.x), static_cast<float>(chart.y));
    x += width;
    tallest = std::max(tallest, height);
    all->width = std::max(all->width, x);
    all->height = std::max(all->height, y + height);
  }
  for (Index& chart : all->of_triangle) {
    if (chart != kNoIndex && left_out[chart] != 0) chart = kNoIndex;
  }
}

}  // namespace

SolidCharts MakeSolidCharts(const TissueScene& scene) {
  SolidCharts charts = Cutter(scene).Cut();
  Pack(&charts);
  return charts;
}

bool SolidsBurn(const TissueScene& scene) {
  return !scene.tube_surface.empty() && scene.thermal.model != ThermalModel::kPaper &&
         FindTool(scene.tools, ToolKind::kHook).has_value();
}

}  // namespace fulcrum
