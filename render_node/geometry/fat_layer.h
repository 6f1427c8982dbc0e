// An interpolative layer (fat): not simulated, it lies between a membrane node and the tube's surface beneath it, and
// follows both (the binding of the paper's eq. 9, used here for a position instead of a force). Pure.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "render_node/geometry/membrane_mesh.h"
#include "render_node/geometry/surface.h"

namespace fulcrum::render {

class FatLayer {
 public:
  /// Every `stride`-th node of the membrane's grid carries a fat vertex. Keeps a reference to the scene's arrays.
  FatLayer(const SceneView& scene, std::uint32_t stride);

  /// Positions and normals from the particles and the membrane as drawn (its dead nodes are in a quiet place there).
  void Update(std::span<const float> xyz, const MembraneMesh& membrane);

  [[nodiscard]] std::span<const Vec3f> positions() const { return positions_; }
  [[nodiscard]] std::span<const Vec3f> normals() const { return normals_; }
  [[nodiscard]] std::span<const Vec2f> materials() const { return materials_; }  ///< (s, t) [m].
  /// 0 where membrane and tube lie as close as anywhere, 1 where there is room for 4 mm more fat. At rest.
  [[nodiscard]] std::span<const float> thickness() const { return thickness_; }
  [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }
  /// How far each vertex has been laid bare, 0 … 1: 1 where `opened` says so of (s, t) [m] or the membrane above is
  /// gone, half beside such a vertex, nothing farther away, so that it ends within triangles and not with them.
  void FindBared(const std::function<bool(const Vec2f& material)>& opened, const MembraneMesh& membrane,
                 std::vector<float>* bared) const;

 private:
  struct Anchor {
    Index node;         // Of the membrane's grid.
    SurfacePoint foot;  // On the tube.
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
