// Anti-aliasing of edges whose place is known: after the scene has been put into the picture, a strip of pixels along
// each edge gets the colours of its two sides in proportion to the share of each pixel on either side (edge.frag). The
// strips are placed in the picture's own pixels, so that edges are sharper than the pixels of a scene drawn with fewer.
// The cost is that of the strips' pixels alone.
#pragma once

#include <array>
#include <osg/Geometry>
#include <span>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "render_node/geometry/outline.h"
#include "render_node/scene_graph/mesh.h"

namespace fulcrum::render {

class EdgeLines {
 public:
  /// Distance from the edge at which the colours of its sides are taken [pixels of the scene]: nearer, a pixel of the
  /// other side takes part in them; farther, they miss what is near the edge, and thin parts. Error of the outlines of
  /// instruments (deploy/docs/measurements/picture) at scales of 1 and 0.52: 2.6 and 7.1 with 0.5, 2.2 and 5.4 with
  /// 0.65, 2.2 and 4.7 with 0.8, 2.7 and 5.1 with 1.
  static constexpr float kReach = 0.75f;

  EdgeLines();

  /// Replaces all strips. @param eye of the picture. @param size of its part of the picture [pixels].
  /// @param circle_radius of the round field across and up [pixels]: its rim is an edge as well. @param reach kReach in
  /// pixels of the picture, as the shader has it.
  void Set(std::span<const EdgeLine> lines, const Laparoscope& eye, const Vec2f& size, const Vec2f& circle_radius,
           float reach);
  [[nodiscard]] osg::Geometry* geometry() const { return mesh_.geometry(); }
  [[nodiscard]] osg::StateSet* state() const { return mesh_.state(); }

 private:
  using Float4 = std::array<float, 4>;
  void AddStrip(const std::array<Vec2f, 2>& ends, const Vec2f& outward, float kind, const std::array<Float4, 2>& depths,
                float half_width);

  Mesh mesh_{"edges", true};
  std::vector<Vec3f> positions_, normals_;
  std::vector<Float4> coordinates_;
  std::vector<Triangle> triangles_;
};

}  // namespace fulcrum::render
