// Edges of rigid meshes as lines in the picture, for smoothing them after the picture has been drawn: outlines, where
// the surface turns away from the eye or ends, and creases. Pure.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::render {

/// The edges of a mesh, each with its faces.
class MeshEdges {
 public:
  struct Edge {
    Index a = 0, b = 0;
    std::array<Index, 2> opposite{};  ///< Third corners of its faces; equal where it has one face.
    bool sharp = false;               ///< Its faces meet at more than kCrease_deg, so that light jumps there.
  };
  static constexpr float kCrease_deg = 30;

  /// Corners at one place count as one, as of faces with normals of their own; edges of more than two faces are left
  /// out. Nothing is assumed of the order of a face's corners.
  MeshEdges(std::span<const Vec3f> positions, std::span<const Triangle> triangles);

  [[nodiscard]] const std::vector<Vec3f>& positions() const { return positions_; }
  [[nodiscard]] const std::vector<Edge>& edges() const { return edges_; }

 private:
  std::vector<Vec3f> positions_;  // Different ones.
  std::vector<Edge> edges_;
};

/// A straight edge in the picture [pixels, from its lower left corner].
struct EdgeLine {
  std::array<Vec2f, 2> ends;
  Vec2f outward;                ///< Unit normal, away from the surface that ends here; of a crease either.
  std::array<float, 2> depths;  ///< Of the ends, along the line of sight's axis [m].
  bool crease = false;          ///< The surface goes on beyond.
};

/// Appends the outlines and creases of a mesh that may be visible, without those outside of the picture. Other surfaces
/// or the mesh itself may hide them.
/// @param to_camera frame of the mesh to that of the camera. @param projection to clip coordinates.
/// @param size of the picture [pixels].
void AppendOutline(const MeshEdges& mesh, const Eigen::Matrix4f& to_camera, const Eigen::Matrix4f& projection,
                   const Vec2f& size, std::vector<EdgeLine>* lines);

/// Share of a square pixel on the inner side of a straight edge at `distance` from its middle [pixels], positive where
/// the middle lies outside; `normal` is the edge's unit normal. Exact.
[[nodiscard]] float Coverage(const Vec2f& normal, float distance);

}  // namespace fulcrum::render
