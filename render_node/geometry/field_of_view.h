// Culling of triangles outside the field of view: for a software rasteriser the processing of a triangle's vertices
// costs more than this test. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "render_node/geometry/laparoscope.h"

namespace fulcrum::render {

enum class Sides { kBoth, kFront };

class FieldOfView {
 public:
  /// Of the cameras of MakeEyes().
  explicit FieldOfView(std::span<const Laparoscope> eyes);

  /// Writes to `seen`, in their order, the triangles that are not completely beyond one edge of the square around the
  /// optics' circle and, with Sides::kFront, are not back-facing; with two eyes those that are so for one of them.
  /// Returns true if `seen` has changed. Positions in frame W [m].
  ///
  /// @param ends  Ascending numbers of triangles at which runs end; each is replaced by the place in `seen`.
  bool Find(std::span<const Vec3f> positions, std::span<const Triangle> triangles, Sides sides,
            std::vector<Triangle>* seen, std::span<std::size_t> ends = {});

 private:
  Eigen::Matrix4f planes_;  // Row k: positive beyond edge k, for an eye in the middle of the two.
  Vec3f eye_W_;             // Middle.
  // Row 0 of the right eye's planes_ minus that of the middle, and its place. The other rows follow: the eyes differ
  // across the picture only.
  Eigen::Vector4f apart_;
  Vec3f half_W_;
  bool stereo_;
  std::vector<std::uint8_t> beyond_;  // Scratch: bit k of a vertex: beyond edge k.
  std::vector<Triangle> found_;
};

}  // namespace fulcrum::render
