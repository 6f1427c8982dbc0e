#include "render_node/geometry/sheet_place.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/sheets.h"

namespace fulcrum::render {
namespace {

constexpr float kBin_m = 0.002f;     // About a cell of the built-in sheet.
constexpr float kRounding = -1e-4f;  // Of a weight: a point on a border belongs to the triangle found first.
constexpr float kFarthest = 3;       // Of a weight of a place that is continued.

/// Weights of the corners at `material`; zero if the triangle has no area.
Vec3f WeightsAt(const Vec2f& a, const Vec2f& b, const Vec2f& c, const Vec2f& material) {
  const Vec2f ab = b - a, ac = c - a, ap = material - a;
  const float area = ab.x() * ac.y() - ab.y() * ac.x();
  if (area == 0) return Vec3f::Zero();
  const float wb = (ap.x() * ac.y() - ap.y() * ac.x()) / area, wc = (ab.x() * ap.y() - ab.y() * ap.x()) / area;
  return {1 - wb - wc, wb, wc};
}

}  // namespace

void SheetPlaces::SetTopology(const MembraneMesh& mesh) {
  if (bin_start_.empty()) MakeBins();
  cut_.clear();
  const std::uint32_t cols = scene_.membrane.cols;
  for (const Triangle& t : mesh.triangles().subspan(mesh.whole_triangles())) {
    const Index node = mesh.NodeOf(t[0]);
    const Index cell = node / cols * (cols - 1) + node % cols;
    const Index triangle = 2 * cell + (mesh.NodeOf(t[1]) == node + 1 ? 0 : 1);
    if (!cut_.empty() && cut_.back().triangle == triangle) {
      ++cut_.back().parts;
    } else {
      cut_.push_back({triangle, t[0], 1});
    }
  }
  std::ranges::sort(cut_, {}, &CutTriangle::triangle);
}

void SheetPlaces::MakeBins() {
  Vec2f extent = Vec2f::Zero();
  for (const Vec2f& m : scene_.membrane_material) extent = extent.cwiseMax(m);
  const auto bin = [](float metres, int bins) {
    return std::clamp(static_cast<int>(std::floor(metres / kBin_m)), 0, bins - 1);
  };
  bins_s_ = static_cast<int>(extent.x() / kBin_m) + 1;
  bins_t_ = static_cast<int>(extent.y() / kBin_m) + 1;
  bin_start_.assign(static_cast<std::size_t>(bins_s_) * static_cast<std::size_t>(bins_t_) + 1, 0);
  const std::uint32_t cols = scene_.membrane.cols;
  const auto each = [&](const auto& visit) {
    for (std::uint32_t row = 0; row + 1 < scene_.membrane.rows; ++row) {
      for (std::uint32_t col = 0; col + 1 < cols; ++col) {
        if (!HasCell(scene_, row, col)) continue;
        const Index node = row * cols + col;
        Vec2f low = scene_.membrane_material[node], high = low;
        for (const Index other : {node + 1, node + cols, node + cols + 1}) {
          low = low.cwiseMin(scene_.membrane_material[other]);
          high = high.cwiseMax(scene_.membrane_material[other]);
        }
        for (int t = bin(low.y(), bins_t_); t <= bin(high.y(), bins_t_); ++t) {
          for (int s = bin(low.x(), bins_s_); s <= bin(high.x(), bins_s_); ++s) {
            visit(static_cast<std::size_t>(t) * static_cast<std::size_t>(bins_s_) + static_cast<std::size_t>(s),
                  row * (cols - 1) + col);
          }
        }
      }
    }
  };
  each([&](std::size_t at, Index) { ++bin_start_[at + 1]; });
  for (std::size_t b = 1; b < bin_start_.size(); ++b) bin_start_[b] += bin_start_[b - 1];
  binned_.resize(bin_start_.back());
  std::vector<std::size_t> next(bin_start_.begin(), bin_start_.end() - 1);
  each([&](std::size_t at, Index cell) { binned_[next[at]++] = cell; });
}

const SheetPlaces::CutTriangle* SheetPlaces::CutAt(Index triangle) const {
  const auto found = std::ranges::lower_bound(cut_, triangle, {}, &CutTriangle::triangle);
  return found != cut_.end() && found->triangle == triangle ? &*found : nullptr;
}

std::optional<SheetPlace> SheetPlaces::Find(const MembraneMesh& mesh, const Vec2f& material) const {
  const Vec2f place = material / kBin_m;
  if (!(place.x() >= 0 && place.y() >= 0 && place.x() < static_cast<float>(bins_s_) &&
        place.y() < static_cast<float>(bins_t_))) {
    return std::nullopt;
  }
  const std::size_t bin =
      static_cast<std::size_t>(place.y()) * static_cast<std::size_t>(bins_s_) + static_cast<std::size_t>(place.x());
  for (std::size_t k = bin_start_[bin]; k < bin_start_[bin + 1]; ++k) {
    for (Index half = 0; half < 2; ++half) {
      const Index triangle = 2 * binned_[k] + half;
      const Triangle nodes = MembraneTriangleAt(scene_.membrane.cols, triangle).nodes;
      const Vec3f weights = WeightsAt(scene_.membrane_material[nodes[0]], scene_.membrane_material[nodes[1]],
                                      scene_.membrane_material[nodes[2]], material);
      if (weights.isZero(0) || weights.minCoeff() < kRounding) continue;
      const CutTriangle* cut = CutAt(triangle);
      if (cut == nullptr) {
        for (const Index node : nodes) {
          if (mesh.node_gone(node)) return std::nullopt;
        }
        return SheetPlace{nodes, weights};
      }
      // The part whose own corners have the largest total weight, as in TriangleParts::IsOf.
      SheetPlace best{{}, weights};
      float most = -1;
      for (std::size_t part = 0; part < cut->parts; ++part) {
        const Index first = cut->first_vertex + static_cast<Index>(3 * part);
        float share = 0;
        for (Index corner = 0; corner < 3; ++corner) {
          if (mesh.sides()[first + corner] > 0) share += weights[corner];
        }
        if (share <= most) continue;
        most = share;
        best.vertices = {first, first + 1, first + 2};
      }
      return best;
    }
  }
  return std::nullopt;
}

SheetPlace SheetPlaces::Continued(const MembraneMesh& mesh, const SheetPlace& place, const Vec2f& material) const {
  const auto at = [&](std::size_t k) { return mesh.materials()[place.vertices[k]]; };
  Vec3f weights = WeightsAt(at(0), at(1), at(2), material).cwiseMax(-kFarthest).cwiseMin(kFarthest);
  const float sum = weights.sum();
  return sum > 0.5f ? SheetPlace{place.vertices, weights / sum} : place;
}

}  // namespace fulcrum::render
