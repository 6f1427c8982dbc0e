// Fills a closed surface with tetrahedra.
#pragma once

#include "services/scene/build.h"
#include "services/scene/mesh_io.h"

namespace fulcrum::scene {

struct TetrahedralMesh {
  std::vector<Vec3d> vertices;
  std::vector<Tetrahedron> tets;  ///< Positive volume, sorted; each vertex belongs to one.
};

/// Delaunay refinement with sliver removal (CGAL Mesh_3), its cell size adjusted until the count is within 10 % of
/// `target_tets`. The same input gives the same mesh. Throws InputError "name: reason".
TetrahedralMesh Tetrahedralise(const TriangleMesh& surface, int target_tets, const std::string& name);

}  // namespace fulcrum::scene
