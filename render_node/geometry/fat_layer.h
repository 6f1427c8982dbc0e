// Fat as an interpolated layer: it is not simulated but placed between the membrane's nodes and the tube's surface
// beneath (the binding of the paper's eq. 9, used for a position instead of a force). Beneath the membrane it gives way
// to it and follows it a little; where the membrane has gone, it stays on the tube. Pure.
#pragma once

#include <span>
#include <vector>

#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/surface.h"

namespace fulcrum::render {

class FatLayer {
 public:
  /// Every `stride`-th node of each sheet over an organ carries a fat vertex. Keeps a reference to the scene's arrays.
  FatLayer(const SceneView& scene, std::uint32_t stride);

  /// Finds where the membrane is cut or removed. To be called after each change of its topology.
  void FindCuts(const MembraneMesh& membrane);

  /// Computes positions, normals and bared shares from the particles and the membrane as drawn, in which removed nodes
  /// have well-defined places. Bared is also what can be seen from `eye_W` [m] past the membrane.
  void Update(std::span<const float> xyz, const MembraneMesh& membrane, const Vec3f& eye_W);

  [[nodiscard]] std::span<const Vec3f> positions() const { return positions_; }
  [[nodiscard]] std::span<const Vec3f> normals() const { return normals_; }
  [[nodiscard]] std::span<const Vec2f> materials() const { return materials_; }  ///< (s, t) [m].
  /// Thickness at rest: 0 where membrane and tube are closest, 1 where their gap is 4 mm larger, negative towards a rim
  /// that is fused with the organ, where there is none.
  [[nodiscard]] std::span<const float> thickness() const { return thickness_; }
  [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }
  /// Bared share of each vertex: 1 where no part of the membrane covers or hides it, falling to 0 beneath it over about
  /// a vertex, so that the border runs within triangles and not along their edges.
  [[nodiscard]] std::span<const float> bared() const { return bared_; }

 private:
  struct Anchor {
    Index node;         // Node of the membrane's grid.
    SurfacePoint foot;  // Nearest point on the tube.
    Vec3f up;           // From foot to membrane at rest, by sides and normal of the foot's triangle.
    float rest_gap;     // Membrane to foot at rest [m].
    float weight;       // 0 on the tube, 1 on the membrane, at rest.
  };
  /// The vertices of one sheet, row by row.
  struct Grid {
    std::size_t first;  // Vertex.
    int rows, cols;
    std::vector<std::uint32_t> node_rows, node_cols;
    std::vector<std::uint8_t> cut;  // Per cell between the vertices, row by row.
    bool any_cut = false;
  };
  void AddSheet(const SceneView& scene, const SheetPart& sheet, std::uint32_t stride, const NearestOnSurface& nearest);
  void FindBared(const Grid& grid, const MembraneMesh& membrane, const Vec3f* eye_W, std::vector<float>* bared);
  /// Place in the grid, in cells, over which the membrane's node of vertex (c, r) lies or, with an eye, is seen.
  [[nodiscard]] Vec2f PlaceOver(const Grid& grid, int c, int r, const MembraneMesh& membrane, const Vec3f* eye_W) const;

  std::vector<Anchor> anchors_;
  std::vector<Grid> grids_;
  std::uint32_t node_cols_ = 0;
  std::vector<Vec3f> ups_;   // [m] Unit, as now.
  std::vector<Vec3f> feet_;  // [m]
  std::vector<Vec2f> over_;  // Scratch: PlaceOver of each vertex.
  std::vector<std::uint8_t> covered_;
  std::vector<Vec3f> positions_;
  std::vector<Vec3f> normals_;
  std::vector<Vec2f> materials_;
  std::vector<float> thickness_;
  std::vector<float> uncovered_;  // Bared share without what an eye sees past the membrane: places do not depend on it.
  std::vector<float> bared_;
  std::vector<Triangle> triangles_;
};

}  // namespace fulcrum::render
