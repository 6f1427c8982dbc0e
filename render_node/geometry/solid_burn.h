// Burns of the solids: an atlas of their charts (services/base/core/solid_charts.h), and the part of their drawn
// surface over which it is laid. Nothing is made before the first patch, and only charts with a burn have triangles.
// Pure.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/surface.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/solid_charts.h"

namespace fulcrum::render {

/// Thermal state of the solids' charts, four bytes a texel as in a TemperaturePatch.
class BurnAtlas {
 public:
  using Texel = std::array<std::uint8_t, 4>;

  BurnAtlas() = default;
  /// Intact tissue at this temperature everywhere.
  BurnAtlas(const SolidCharts& charts, float body_temperature_C);

  /// Copies the part of the patch that lies within the atlas. Returns the changed rectangle.
  /// @pre the patch has the right size and begins within 4096 x 4096 texels.
  AtlasRect Copy(const TemperaturePatch& patch);

  /// What texels are before the first patch.
  [[nodiscard]] const Texel& intact() const { return intact_; }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  /// 4 * width * height bytes, row by row, t slow and s fast.
  [[nodiscard]] std::span<const std::uint8_t> texels() const { return texels_; }
  /// By chart; empty: it has no place because the atlas was full.
  [[nodiscard]] std::span<const AtlasRect> boxes() const { return boxes_; }

 private:
  int width_ = 0, height_ = 0;
  Texel intact_{};
  std::vector<std::uint8_t> texels_;
  std::vector<AtlasRect> boxes_;
};

/// The texels of some charts, as they were when this was made.
class BurnCharts {
 public:
  BurnCharts() = default;
  /// @param charts numbers of charts of the atlas, each once.
  BurnCharts(const BurnAtlas& atlas, std::span<const Index> charts);

  /// Texel at (s, t) [m]; no value outside the chart's box, or of another chart.
  [[nodiscard]] std::optional<BurnAtlas::Texel> At(Index chart, const Vec2f& material) const;
  /// What texels are before the first patch.
  [[nodiscard]] const BurnAtlas::Texel& intact() const { return intact_; }

 private:
  BurnAtlas::Texel intact_{};
  std::vector<AtlasRect> boxes_;    // By number of the chart; empty: not one of these.
  std::vector<std::size_t> first_;  // By number of the chart: its first texel.
  std::vector<BurnAtlas::Texel> texels_;
};

class SolidBurn {
 public:
  /// Computes nothing. The arrays of `scene` must outlive it.
  explicit SolidBurn(const SceneView& scene) : scene_(scene) {}

  /// Copies the part of the patch that lies within the atlas, and adds the triangles of the charts in which it shows a
  /// first burn. Returns the changed rectangle; empty if the patch is of another surface, has the wrong size or lies
  /// outside.
  AtlasRect Apply(const TemperaturePatch& patch);

  /// By corner: its vertex in SceneView::surface_vertices.
  [[nodiscard]] std::span<const Index> vertices() const { return vertices_; }
  /// By corner: (s, t) in the charts [m].
  [[nodiscard]] std::span<const Vec2f> materials() const { return materials_; }
  /// By corner: its chart.
  [[nodiscard]] std::span<const Index> charts() const { return chart_of_corner_; }
  /// By corner: lowest and highest (s, t) of its chart [m]. Beyond lie texels of other charts.
  [[nodiscard]] std::span<const std::array<float, 4>> boxes() const { return boxes_; }
  /// By their corners. Charts share no corners, and a triangle over the border of two charts is there for each.
  [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }
  /// Grows whenever triangles are added.
  [[nodiscard]] std::uint64_t additions() const { return additions_; }

  /// Empty before the first patch. Its texels keep their place in memory from then on.
  [[nodiscard]] const BurnAtlas& atlas() const { return atlas_; }

 private:
  /// The surfaces of one solid.
  struct Body {
    std::span<const Triangle> drawn;
    std::vector<Triangle> simulated;
    std::vector<Index> numbers;               ///< Of the simulated ones, in TissueScene::tube_surface.
    std::optional<NearestOnSurface> nearest;  ///< Among the simulated ones at rest.
  };
  void Prepare();
  [[nodiscard]] bool ShowsBurn(const AtlasRect& rect) const;
  void AddChart(Index index);
  Body& BodyWith(Index particle);
  [[nodiscard]] Index ChartAt(const Body& body, const Vec3f& rest) const;
  [[nodiscard]] Index ChartOfVertex(const Body& body, Index vertex);

  SceneView scene_;
  std::optional<SolidCharts> charts_;
  std::vector<std::unique_ptr<Body>> bodies_;  // By solid; made when a chart of it is added.
  std::vector<Index> solid_of_;                // By particle of the solids.
  std::vector<Vec3f> rest_;                    // Of the drawn vertices [m].
  std::vector<Index> chart_of_;                // Of the drawn vertices, as far as known.
  std::vector<std::uint8_t> added_;            // By chart.
  BurnAtlas atlas_;
  std::vector<Index> vertices_;
  std::vector<Vec2f> materials_;
  std::vector<Index> chart_of_corner_;
  std::vector<std::array<float, 4>> boxes_;
  std::vector<Triangle> triangles_;
  std::uint64_t additions_ = 0;
};

}  // namespace fulcrum::render
