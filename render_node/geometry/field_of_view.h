// Culling of triangles outside the field of view: for a software rasteriser the processing of a triangle's vertices
// costs more than this test. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render_node/geometry/laparoscope.h"

namespace fulcrum::render {

enum class Sides { kBoth, kFront };

class FieldOfView {
 public:
  explicit FieldOfView(const Laparoscope& scope);

  /// Writes to `seen`, in their order, the triangles that are not completely beyond one edge of the square around the
  /// optics' circle and, with Sides::kFront, are not back-facing. Returns true if `seen` has changed. Positions in
  /// frame W [m].
  bool Find(std::span<const Vec3f> positions, std::span<const Triangle> triangles, Sides sides,
            std::vector<Triangle>* seen);

 private:
  Eigen::Matrix4f planes_;  // Row k: positive beyond edge k.
  Vec3f eye_W_;
  std::vector<std::uint8_t> beyond_;  // Scratch: bit k of a vertex: beyond edge k.
  std::vector<Triangle> found_;
};

}  // namespace fulcrum::render
