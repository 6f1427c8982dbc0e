// Repair of tetrahedral meshes from other programs.
#pragma once

#include <string>
#include <vector>

#include "services/base/core/error.h"
#include "services/scene/readers/mesh_io.h"

namespace fulcrum::scene {

struct TetrahedralMesh {
  std::vector<Vec3d> vertices;
  std::vector<Tetrahedron> tets;  ///< Positive volume, sorted; each vertex belongs to one.
};

struct TetRepairReport {
  std::size_t vertices_merged = 0;  ///< Vertices at the same place as another one.
  std::size_t turned = 0;           ///< Tetrahedra of negative volume, of which two corners were swapped.
  std::size_t doubles_dropped = 0;  ///< Tetrahedra with the same corners as another one, or with one corner twice.
  std::size_t pieces_dropped = 0;   ///< Parts that share no face with the largest.
  double least_dihedral_deg = 0, largest_dihedral_deg = 0;
};

/// A fault of the tetrahedra that only filling their surface anew mends.
class FlawError : public InputError {
 public:
  using InputError::InputError;
};

/// The largest piece of the file's tetrahedra, turned to positive volume, as a mesh in which every face belongs to one
/// or two tetrahedra on opposite sides of it; vertices and tetrahedra sorted by place. Throws FlawError "name:
/// tetrahedron 12 ...: reason" for faults that cannot be repaired: flat tetrahedra (a dihedral angle below 1 degree),
/// overlapping ones, faces with three.
TetrahedralMesh RepairTetrahedra(const MeshFile& file, const std::string& name, TetRepairReport* report);

}  // namespace fulcrum::scene
