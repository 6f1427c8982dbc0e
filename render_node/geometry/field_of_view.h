// Which triangles can be seen at all: a software rasteriser spends more on a triangle's corners than on finding out
// that it lies outside the field. Pure.
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

  /// Puts into `seen`, in their order, the triangles of `triangles` that are not wholly beyond one edge of the square
  /// round the optics' circle and, with Sides::kFront, do not turn their back on the eye. True when `seen` is another
  /// list than before. Positions in frame W [m].
  bool Find(std::span<const Vec3f> positions, std::span<const Triangle> triangles, Sides sides,
            std::vector<Triangle>* seen);

 private:
  Eigen::Matrix4f planes_;  // Row k: positive beyond edge k.
  Vec3f eye_W_;
  std::vector<std::uint8_t> beyond_;  // Scratch: bit k of a vertex: beyond edge k.
  std::vector<Triangle> found_;
};

}  // namespace fulcrum::render
