#include "render_node/geometry/sheet_rim.h"

#include <algorithm>
#include <array>

#include "render_node/geometry/surface.h"
#include "services/base/core/sheets.h"

namespace fulcrum::render {
namespace {

constexpr float kRim_m = 0.021f;
constexpr float kNear_m = 0.003f;
constexpr std::uint32_t kSamplesOfASide = 16;

/// Sides of the grid.
struct Sides {
  bool before_rows = false, after_rows = false, before_cols = false, after_cols = false;
  [[nodiscard]] bool any() const { return before_rows || after_rows || before_cols || after_cols; }
};

class Sheet {
 public:
  Sheet(const SceneView& scene, const SheetPart& part)
      : scene_(scene), first_row_(part.first_row), last_row_(part.rows - 1), last_col_(part.cols - 1) {}

  /// The sides most of which are near these triangles.
  [[nodiscard]] Sides Near(std::span<const Vec3f> vertices, std::span<const Triangle> triangles) const {
    if (triangles.empty()) return {};
    const NearestOnSurface nearest(vertices, triangles);
    const std::span<const float> xyz(vertices.front().data(), 3 * vertices.size());
    const auto is_near = [&](std::uint32_t row_step, std::uint32_t row, std::uint32_t col_step, std::uint32_t col) {
      std::uint32_t near = 0;
      for (std::uint32_t k = 0; k < kSamplesOfASide; ++k) {
        const Vec3f p = Place(row + k * row_step / (kSamplesOfASide - 1), col + k * col_step / (kSamplesOfASide - 1));
        near += (nearest.Find(p).At(xyz) - p).norm() < kNear_m ? 1 : 0;
      }
      return 2 * near > kSamplesOfASide;
    };
    return {is_near(0, 0, last_col_, 0), is_near(0, last_row_, last_col_, 0), is_near(last_row_, 0, 0, 0),
            is_near(last_row_, 0, 0, last_col_)};
  }

  /// `sign` on these sides, falling to 0; by node of the whole grid.
  void From(const Sides& sides, float sign, std::vector<float>* rim) const {
    // Steps of the grid in its middle.
    const std::uint32_t r = last_row_ / 2, c = last_col_ / 2;
    const float along = (Place(r + 1, c) - Place(r, c)).norm(), across = (Place(r, c + 1) - Place(r, c)).norm();
    const float width =
        std::min({kRim_m, along * static_cast<float>(last_row_) / 3, across * static_cast<float>(last_col_) / 3});
    if (!(width > 0)) return;
    for (std::uint32_t row = 0; row <= last_row_; ++row) {
      for (std::uint32_t col = 0; col <= last_col_; ++col) {
        float inside = width;
        if (sides.before_rows) inside = std::min(inside, along * static_cast<float>(row));
        if (sides.after_rows) inside = std::min(inside, along * static_cast<float>(last_row_ - row));
        if (sides.before_cols) inside = std::min(inside, across * static_cast<float>(col));
        if (sides.after_cols) inside = std::min(inside, across * static_cast<float>(last_col_ - col));
        (*rim)[(first_row_ + row) * scene_.membrane.cols + col] = sign * (1 - inside / width);
      }
    }
  }

 private:
  [[nodiscard]] const Vec3f& Place(std::uint32_t row, std::uint32_t col) const {
    return scene_.rest_position[scene_.membrane.first + (first_row_ + row) * scene_.membrane.cols + col];
  }

  const SceneView& scene_;
  std::uint32_t first_row_, last_row_, last_col_;
};

}  // namespace

std::vector<float> SheetRim(const SceneView& scene) {
  std::vector<float> rim(scene.membrane.node_count(), 0.0f);
  std::vector<Triangle> around;
  for (const StaticSurface& surface : scene.static_surfaces) {
    if (surface.role != SurfaceRole::kRetroperitoneum) continue;
    const auto triangles = scene.static_triangles.subspan(surface.first_triangle, surface.triangle_count);
    around.insert(around.end(), triangles.begin(), triangles.end());
  }
  for (const SheetPart& part : SheetsOf(scene)) {
    const Sheet sheet(scene, part);
    if (const Sides sides = sheet.Near(scene.static_vertices, around); sides.any()) {
      sheet.From(sides, 1, &rim);
    } else {
      sheet.From(sheet.Near(scene.rest_position, scene.tube_surface), -1, &rim);
    }
  }
  return rim;
}

}  // namespace fulcrum::render
