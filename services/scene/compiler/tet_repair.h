// Makes a usable organ of tetrahedra that others made.
#pragma once

#include <string>
#include <vector>

#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

struct TetrahedralMesh {
  std::vector<Vec3d> vertices;
  std::vector<Tetrahedron> tets;  ///< Positive volume, sorted; each vertex belongs to one.
};

struct TetRepairReport {
  std::size_t vertices_merged = 0;  ///< At the same place as another one.
  std::size_t turned = 0;           ///< Of negative volume: two corners swapped.
  std::size_t doubles_dropped = 0;  ///< The same corners as another one, or one corner twice.
  std::size_t pieces_dropped = 0;   ///< Parts that share no face with the largest.
  double least_dihedral_deg = 0, largest_dihedral_deg = 0;
};

/// The largest piece of the file's tetrahedra, turned to positive volume, as a mesh in which every face belongs to one
/// or two tetrahedra on opposite sides of it; vertices and tetrahedra in order of place. Throws InputError
/// "name: tetrahedron 12 ...: reason" for what cannot be put right: flat ones (a dihedral angle below 1 degree),
/// overlapping ones, faces with three.
TetrahedralMesh RepairTetrahedra(const MeshFile& file, const std::string& name, TetRepairReport* report);

}  // namespace fulcrum::scene
