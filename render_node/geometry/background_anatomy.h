// Anatomy that is not simulated, as decoration: loops of small bowel and cords of fat between them, in the free space
// behind everything that the scene uses. Pure, and the same for the same scene and seed.
#pragma once

#include <cstdint>
#include <vector>

#include "render_node/geometry/free_space.h"

namespace fulcrum::render {

class BackgroundAnatomy {
 public:
  struct Vertex {
    Vec3f p_W, normal;
    Vec2f place;     ///< For patterns [m]: as long as on the surface, but for a tenth.
    float openness;  ///< As Openness().
    float fat;       ///< 0 bowel, 1 fat.
    float shade;     ///< Of its loop or cord: -1 dark … 1 light.
  };
  /// The software rasteriser needs a third more for a picture with a moved scope where the rest is a bare sphere.
  static constexpr std::size_t kMostTriangles = 16'300;

  /// @param seed another one, other loops: Look::patterns.
  BackgroundAnatomy(const SceneView& scene, std::uint32_t seed);

  [[nodiscard]] const std::vector<Vertex>& vertices() const { return vertices_; }
  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Share of the light that arrives at `p` on a surface of this unit normal: 1 without a loop or cord nearby.
  [[nodiscard]] float Openness(const Vec3f& p, const Vec3f& normal) const;
  [[nodiscard]] const Cavity& cavity() const { return space_.cavity(); }

 private:
  struct Ring {
    Vec3f p_W;
    float radius;
  };
  class Draws;

  void AddLoops(Draws* draws);
  std::vector<Ring> Grow(const Vec3f& start, float radius, bool fat, Draws* draws);
  bool Lies(const Vec3f& p, float radius) const;
  bool Fits(const Vec3f& p, float radius, float pressed) const;
  float Cost(const Vec3f& p) const;
  void AddTube(std::vector<Ring> rings, bool fat, Draws* draws);
  void AddFat(const std::vector<Vec3f>& ends, Draws* draws);

  FreeSpace space_;
  Vec3f scope_tip_, sight_, across_;
  float field_cosine_;    // Of half the angle of view, with a margin.
  GridField decoration_;  // Distance to loops and cords.
  std::vector<Vertex> vertices_;
  std::vector<Triangle> triangles_;
};

}  // namespace fulcrum::render
