// Places of the sheet's own coordinates in space, also beside a slit. Pure.
#pragma once

#include <optional>
#include <vector>

#include "render_node/geometry/membrane_mesh.h"

namespace fulcrum::render {

/// A point as weights of three vertices of a MembraneMesh; they sum to 1.
struct SheetPlace {
  Triangle vertices{};
  Vec3f weights = Vec3f::Zero();

  [[nodiscard]] Vec3f Of(std::span<const Vec3f> values) const {
    return weights[0] * values[vertices[0]] + weights[1] * values[vertices[1]] + weights[2] * values[vertices[2]];
  }
};

/// Finds the triangle of a MembraneMesh at a place of the sheet.
class SheetPlaces {
 public:
  /// Keeps a reference to the arrays of `scene`. Nothing is computed before the first SetTopology().
  explicit SheetPlaces(const SceneView& scene) : scene_(scene) {}

  /// Takes the cut triangles of `mesh`.
  void SetTopology(const MembraneMesh& mesh);

  /// The drawn triangle or, over a slit, the part of it at (s, t) [m]; none where nothing is drawn.
  [[nodiscard]] std::optional<SheetPlace> Find(const MembraneMesh& mesh, const Vec2f& material) const;

  /// The plane of a place continued to (s, t) [m]; as the ghosts of a slit, it is not stretched. Up to about a cell
  /// away.
  [[nodiscard]] SheetPlace Continued(const MembraneMesh& mesh, const SheetPlace& place, const Vec2f& material) const;

  /// A triangle with a slit through it.
  struct CutTriangle {
    Index triangle;      ///< Its number, as in MembraneTriangleAt.
    Index first_vertex;  ///< Of its first part in the mesh; three for each part.
    std::size_t parts;
  };
  /// By number.
  [[nodiscard]] const std::vector<CutTriangle>& cut_triangles() const { return cut_; }

 private:
  void MakeBins();
  [[nodiscard]] const CutTriangle* CutAt(Index triangle) const;

  SceneView scene_;
  std::vector<CutTriangle> cut_;
  // Cells of the grid by place: bin b has the cells binned_[bin_start_[b]] to before binned_[bin_start_[b + 1]].
  int bins_s_ = 0, bins_t_ = 0;
  std::vector<std::size_t> bin_start_;
  std::vector<Index> binned_;
};

}  // namespace fulcrum::render
