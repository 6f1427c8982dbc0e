// A stand-in for the shadows of the instruments: a soft dark ribbon on the tissue behind each. Pure.
//
//        eye · light                     The ribbon runs where rays from the light through the instrument's axis meet
//             \  \                       tissue. It is seen beside the instrument as far as the light stands beside the
//              \  ●  instrument          eye and as the tissue lies behind: so its distance tells the height, as in the
//               \  \                     operation. Width and softness grow with the height, too.
//     ───────────\──▬▬▬──── tissue
//
// What a ray meets is read from a coarse map of depths as the light sees the tissue, made anew from its vertices: no
// ray is cast, no pixel of tissue pays anything.
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

  /// Ribbons of all tools (kind kNone has none) on the particles `xyz` (3 n floats, frame W, m) and what stands still.
  void Update(const Laparoscope& scope, std::span<const float> xyz, std::span<const ToolSample, kMaxTools> tools);

  [[nodiscard]] std::span<const Vec3f> positions() const { return positions_; }  ///< Frame W [m].
  /// Per vertex: place across the ribbon -1 … 1, share of it that is soft edge 0 … 1, opacity 0 … 1, and how far it may
  /// be drawn in front of its place without covering the instrument [m].
  [[nodiscard]] std::span<const std::array<float, 4>> coordinates() const { return coordinates_; }
  [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }

  /// Camera frame [m]: three times as far beside the eye as the fibres are. From their true place nearly all of a
  /// shadow hides behind what casts it.
  [[nodiscard]] static Vec3f LightPlace(const Laparoscope& scope) { return 3 * scope.light_position; }

 private:
  static constexpr int kCellsAcross = 96, kCellsUp = 64;

  void FindDepths(const Laparoscope& scope, std::span<const float> xyz);
  [[nodiscard]] float DepthAt(const Vec2f& direction) const;
  void AppendRibbon(const Laparoscope& scope, const ToolDescription& tool, const ToolSample& sample);

  SceneView scene_;
  Vec2f reach_ = Vec2f::Ones();        // Of the map: x / depth and y / depth at its rims, seen from the light.
  std::vector<float> depth_, filled_;  // [cells] from the light along the line of sight [m]; 0: nothing there.
  std::vector<Vec3f> positions_;
  std::vector<std::array<float, 4>> coordinates_;
  std::vector<Triangle> triangles_;
};

}  // namespace fulcrum::render
