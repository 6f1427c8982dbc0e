// Fills a closed surface with tetrahedra.
#pragma once

#include <string>

#include "services/scene/compiler/tet_repair.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

/// Delaunay refinement with sliver removal (CGAL Mesh_3), its cell size adjusted until the count is within 10 % of
/// `target_tets`, or the nearest attempt if it has 0.6 to 1.67 times as many. The same input gives the same mesh.
/// Throws InputError "name: reason".
TetrahedralMesh Tetrahedralise(const TriangleMesh& surface, int target_tets, const std::string& name);

/// Volume inside a closed surface; its cube of length is that of the vertices.
double EnclosedVolume(const TriangleMesh& surface);

/// Approximate number of tetrahedra of this mean edge that fill a closed surface.
int TetsOfEdge(const TriangleMesh& surface, double edge);

}  // namespace fulcrum::scene
