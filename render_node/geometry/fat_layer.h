// Fat as an interpolated layer: it is not simulated but placed between the membrane's nodes and the tube's surface
// beneath, and follows both (the binding of the paper's eq. 9, used for a position instead of a force). Pure.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/surface.h"

namespace fulcrum::render {

class FatLayer {
 public:
  /// Every `stride`-th node of each sheet over an organ carries a fat vertex. Keeps a reference to the scene's arrays.
  FatLayer(const SceneView& scene, std::uint32_t stride);

  /// Computes positions and normals from the particles and the membrane as drawn, in which removed nodes have
  /// well-defined places.
  void Update(std::span<const float> xyz, const MembraneMesh& membrane);

  [[nodiscard]] std::span<const Vec3f> positions() const { return positions_; }
  [[nodiscard]] std::span<const Vec3f> normals() const { return normals_; }
  [[nodiscard]] std::span<const Vec2f> materials() const { return materials_; }  ///< (s, t) [m].
  /// Thickness at rest: 0 where membrane and tube are closest, 1 where their gap is 4 mm larger, negative towards a rim
  /// that is fused with the organ, where there is none.
  [[nodiscard]] std::span<const float> thickness() const { return thickness_; }
  [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }
  /// Bared share of each vertex: 1 where `opened` is true for (s, t) [m] or the membrane above is removed, 0.5 beside
  /// such a vertex, otherwise 0, so that the border runs within triangles and not along their edges.
  void FindBared(const std::function<bool(const Vec2f& material)>& opened, const MembraneMesh& membrane,
                 std::vector<float>* bared) const;

 private:
  void AddSheet(const SceneView& scene, const SheetPart& sheet, std::uint32_t stride, const NearestOnSurface& nearest);

  struct Anchor {
    Index node;         // Node of the membrane's grid.
    SurfacePoint foot;  // Nearest point on the tube.
    float rest_gap;     // Membrane to foot at rest [m].
    float weight;       // 0 on the tube, 1 on the membrane, at rest.
  };
  std::vector<Anchor> anchors_;
  std::vector<Vec3f> positions_;
  std::vector<Vec3f> normals_;
  std::vector<Vec2f> materials_;
  std::vector<float> thickness_;
  std::vector<Triangle> triangles_;
};

}  // namespace fulcrum::render
