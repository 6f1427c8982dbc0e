// The deformed membrane in the world, cut or not: finds the place of the sheet that is nearest to a point.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/base/core/slit_sheet.h"

namespace fulcrum::log_tools {

/// Uses the scene's grid and the recorded positions, but no solver, so that it is an independent check of what the
/// solvers report.
class DeformedSheet {
 public:
  /// @param scene must outlive the object.
  explicit DeformedSheet(const SceneView& scene);

  /// Sets the bits of a TopologyState. Each side of a slit continues unstretched up to its lip; removed tissue spans
  /// the gap.
  void SetTopology(std::span<const std::uint8_t> dead_nodes, std::span<const std::uint8_t> dead_edges);
  /// Whether the place (s, t) [m] of the sheet is removed: determines the lips on a severed edge.
  using Removed = std::function<bool(const Vec2f& material)>;
  /// Sets the positions of all particles as in a TissueFrame; false if they do not fit the scene.
  bool SetPositions(std::span<const float> xyz, const Removed& removed);

  struct Place {
    float distance_m = 0;
    Vec2f material = Vec2f::Zero();  ///< (s, t) [m].
    std::size_t sheet = 0;           ///< Which of SheetsOf(scene).
  };
  /// The nearest place; empty if all sheets are farther away than `within_m`. @param skin_m by sheet, or empty: what
  /// surrounds its middle there. Of several sheets the one with the nearest skin is taken.
  [[nodiscard]] std::optional<Place> Nearest(const Vec3f& p_W, float within_m,
                                             std::span<const float> skin_m = {}) const;

 private:
  struct Point {
    Vec3f place;
    Vec2f material;
  };
  /// Piece of a cut triangle: tissue attached to a corner, or the gap.
  using Piece = std::array<Point, 3>;
  /// Access to this sheet for SlitSheet.
  struct Held {
    const DeformedSheet& sheet;
    [[nodiscard]] std::uint32_t rows() const { return sheet.scene_.membrane.rows; }
    [[nodiscard]] std::uint32_t cols() const { return sheet.scene_.membrane.cols; }
    [[nodiscard]] bool Gone(Index node) const { return sheet.dead_[node] != 0 || sheet.absent_[node] != 0; }
    [[nodiscard]] bool Severed(std::size_t edge) const { return sheet.severed_[edge] != 0; }
    [[nodiscard]] Vec3f Place(Index node) const { return sheet.place_[node]; }
    [[nodiscard]] Vec3f Rest(Index node) const {
      return sheet.scene_.rest_position[sheet.scene_.membrane.first + node];
    }
    [[nodiscard]] Vec2f Material(Index node) const { return sheet.scene_.membrane_material[node]; }
  };
  [[nodiscard]] std::size_t Node(int row, int col) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(col);
  }
  void FillDeadNodes();
  [[nodiscard]] std::optional<Place> NearestOn(const SheetPart& sheet, const Vec3f& p_W, float within_m) const;
  void CutIntoPieces(const Removed& removed);

  const SceneView& scene_;
  int rows_, cols_;
  float coarse_reach_m_ = 0;
  std::vector<std::uint8_t> absent_, dead_, severed_;  ///< By node; by edge.
  std::vector<std::size_t> dead_nodes_;
  std::vector<Vec3f> place_;          ///< [rows * cols] frame W [m]; dead nodes: for the first search only.
  std::vector<Index> cut_triangles_;  ///< Triangles with two or three dead edges, ascending.
  std::vector<std::int32_t> cut_of_;  ///< By triangle: its index in cut_triangles_; -1: not cut.
  std::vector<Piece> pieces_;
  std::vector<std::size_t> first_piece_;  ///< By index in cut_triangles_, with one more at the end.
};

}  // namespace fulcrum::log_tools
