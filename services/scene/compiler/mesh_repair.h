// Repair of surface meshes from real data. CGAL is used in this source and in that of tetrahedralise.h only.
#pragma once

#include <string>

#include "services/scene/compiler/spot.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// The surface has openings, and nothing says how to close them.
class OpenSurfaceError : public SpotError {
 public:
  using SpotError::SpotError;
};

struct SurfaceRepair {
  double min_edge = 0;        ///< Shorter edges are collapsed.
  bool cap_openings = false;  ///< Close an open surface.
  double wall = 0;  ///< > 0: the result bounds a wall of this thickness below the surface; openings become its rims.
};

struct RepairReport {
  std::size_t openings_capped = 0;
  std::size_t pieces_dropped = 0;  ///< Separate pieces other than the largest.
  std::size_t edges_collapsed = 0;
  std::size_t caps_flipped = 0;  ///< Flat triangles removed by flipping their longest edge.
  /// Remaining pairs of intersecting triangles: inside a wrap they are filled.
  std::size_t self_intersections = 0;
  double least_edge = 0, least_angle_deg = 0;  ///< After the repair.
  bool is_wrapped = false;                     ///< The result is a wrap (WrapSurface).
};

/// The largest piece of `mesh` as a closed, outward-oriented two-manifold without short edges and without needle or cap
/// triangles where its topology allows, of at most 120,000 triangles. What stays open or in pieces is wrapped. Throws
/// OpenSurfaceError if the surface is open and `settings` do not say how to close it, or if the inner side of
/// the wall intersects itself.
TriangleMesh RepairSurface(const TriangleMesh& mesh, const SurfaceRepair& settings, const std::string& name,
                           RepairReport* report);

/// The closed surface around all triangles, free of crossings, whatever their faults: an alpha wrap (Portaneri et al.
/// 2022). Details below an eightieth of the size disappear; of separate wraps the largest remains. Throws InputError if
/// no triangle has an area.
TriangleMesh WrapSurface(const TriangleMesh& mesh, std::size_t* pieces_dropped);

/// Edge collapse (Lindstrom, Turk 1998) down to `triangles_max`; pieces and holes remain. Orientation is made
/// consistent.
TriangleMesh Decimate(const TriangleMesh& mesh, int triangles_max);

}  // namespace fulcrum::scene
