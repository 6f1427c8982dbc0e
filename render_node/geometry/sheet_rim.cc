#include "render_node/geometry/sheet_rim.h"

#include <algorithm>
#include <array>

#include "render_node/geometry/surface.h"

namespace fulcrum::render {
namespace {

constexpr float kRim_m = 0.021f;
constexpr float kNear_m = 0.003f;
constexpr std::uint32_t kSamplesOfASide = 16;

}  // namespace

std::vector<float> SheetRim(const SceneView& scene) {
  const MembraneGrid& grid = scene.membrane;
  std::vector<float> rim(grid.node_count(), 0.0f);
  std::vector<Triangle> around;
  for (const StaticSurface& surface : scene.static_surfaces) {
    if (surface.role != SurfaceRole::kRetroperitoneum) continue;
    const auto triangles = scene.static_triangles.subspan(surface.first_triangle, surface.triangle_count);
    around.insert(around.end(), triangles.begin(), triangles.end());
  }
  if (around.empty() || grid.rows < 2 || grid.cols < 2) return rim;

  const auto place = [&](std::uint32_t row, std::uint32_t col) {
    return scene.rest_position[grid.first + row * grid.cols + col];
  };
  const NearestOnSurface nearest(scene.static_vertices, around);
  const std::span<const float> vertices(scene.static_vertices.front().data(), 3 * scene.static_vertices.size());
  const std::uint32_t last_row = grid.rows - 1, last_col = grid.cols - 1;
  const auto goes_on = [&](const auto& place_at, std::uint32_t last) {
    std::uint32_t near = 0;
    for (std::uint32_t k = 0; k < kSamplesOfASide; ++k) {
      const Vec3f p = place_at(k * last / (kSamplesOfASide - 1));
      near += (nearest.Find(p).At(vertices) - p).norm() < kNear_m ? 1 : 0;
    }
    return 2 * near > kSamplesOfASide;
  };
  const bool before_rows = goes_on([&](std::uint32_t at) { return place(0, at); }, last_col);
  const bool after_rows = goes_on([&](std::uint32_t at) { return place(last_row, at); }, last_col);
  const bool before_cols = goes_on([&](std::uint32_t at) { return place(at, 0); }, last_row);
  const bool after_cols = goes_on([&](std::uint32_t at) { return place(at, last_col); }, last_row);

  // Steps of the grid in its middle.
  const std::uint32_t r = last_row / 2, c = last_col / 2;
  const float along = (place(r + 1, c) - place(r, c)).norm(), across = (place(r, c + 1) - place(r, c)).norm();
  const float width =
      std::min({kRim_m, along * static_cast<float>(last_row) / 3, across * static_cast<float>(last_col) / 3});
  if (!(width > 0)) return rim;
  for (std::uint32_t row = 0; row < grid.rows; ++row) {
    for (std::uint32_t col = 0; col < grid.cols; ++col) {
      float inside = width;
      if (before_rows) inside = std::min(inside, along * static_cast<float>(row));
      if (after_rows) inside = std::min(inside, along * static_cast<float>(last_row - row));
      if (before_cols) inside = std::min(inside, across * static_cast<float>(col));
      if (after_cols) inside = std::min(inside, across * static_cast<float>(last_col - col));
      rim[row * grid.cols + col] = 1 - inside / width;
    }
  }
  return rim;
}

}  // namespace fulcrum::render
