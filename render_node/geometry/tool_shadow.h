// Approximate shadows of the instruments: a soft dark ribbon on the tissue behind each. Pure.
//
//        eye · light                     The ribbon runs where rays from the light through the instrument's axis meet
//             \  \                       tissue. It is seen beside the instrument as far as the light stands beside the
//              \  ●  instrument          eye and as the tissue lies behind: so its distance tells the height, as in the
//               \  \                     operation. Width and softness grow with the height, too.
//     ───────────\──▬▬▬──── tissue
//
// The point where a ray meets tissue is read from a coarse depth map from the light's position, which is computed from
// the vertices of the tissue. So there is no ray casting and no cost per pixel of tissue.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

class ToolShadow {
 public:
  /// Keeps a reference to the arrays of `scene`.
  explicit ToolShadow(const SceneView& scene) : scene_(scene) {}

  /// Ribbons of all tools (kind kNone has none) on the particles `xyz` (3 n floats, frame W, m) and the fixed surfaces.
  void Update(const Laparoscope& scope, std::span<const float> xyz, std::span<const ToolSample, kMaxTools> tools);

  [[nodiscard]] std::span<const Vec3f> positions() const { return positions_; }  ///< Frame W [m].
  /// Per vertex: coordinate across the ribbon -1 … 1, share of the soft edge 0 … 1, opacity 0 … 1, and the distance by
  /// which it may be drawn in front of the tissue without covering the instrument [m].
  [[nodiscard]] std::span<const std::array<float, 4>> coordinates() const { return coordinates_; }
  [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }

  /// Position of the light that casts the shadows, camera frame [m]: three times as far beside the eye as the fibres.
  /// From the true position nearly the whole shadow would be hidden behind its instrument.
  [[nodiscard]] static Vec3f LightPlace(const Laparoscope& scope) { return 3 * scope.light_position; }

 private:
  static constexpr int kCellsAcross = 96, kCellsUp = 64;

  void FindDepths(const Laparoscope& scope, std::span<const float> xyz);
  [[nodiscard]] float DepthAt(const Vec2f& direction) const;
  void AppendRibbon(const Laparoscope& scope, const ToolDescription& tool, const ToolSample& sample);

  SceneView scene_;
  Vec2f reach_ = Vec2f::Ones();  // Extent of the map: x / depth and y / depth at its borders, seen from the light.
  // Per cell: distance of tissue from the light along the line of sight [m]; 0: none.
  std::vector<float> depth_, filled_;
  std::vector<Vec3f> positions_;
  std::vector<std::array<float, 4>> coordinates_;
  std::vector<Triangle> triangles_;
};

}  // namespace fulcrum::render
