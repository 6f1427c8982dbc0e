// Reads meshes from files of other programs: Gmsh, VTK legacy, VTU, TetGen, VTP, STL, OBJ, OFF, PLY. Files are
// untrusted: sizes are compared with the number of bytes in the file before memory is allocated.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::scene {

/// Vertices in the file's own unit. There may be triangles without area; indices are in range, vertices finite.
struct TriangleMesh {
  std::vector<Vec3d> vertices;
  std::vector<Triangle> triangles;
};

/// Content of a mesh file: triangles (polygons are split into fans), tetrahedra (in the file's own orientation), or
/// both. Points and lines are counted and omitted. Cells whose omission would leave a hole (hexahedra, prisms,
/// pyramids, anything of second order) are refused.
struct MeshFile {
  std::vector<Vec3d> vertices;
  std::vector<Triangle> triangles;
  std::vector<Tetrahedron> tets;
  std::size_t skipped = 0;  ///< Points and lines.
};

inline constexpr std::size_t kMaxMeshElements = 10'000'000;  ///< Largest number of vertices, and of elements.
inline constexpr std::size_t kMaxMeshBytes = 2'000'000'000;  ///< Largest size of a file.

/// Selects the format by the first bytes or, if they are not distinctive, by the extension. For a TetGen file its
/// companion is read too: .node for .ele and .face; .ele or else .face for .node. Throws InputError "file: place:
/// reason".
MeshFile ReadMesh(const std::filesystem::path& file);

/// Returns the bytes of a companion file; none if the file does not exist.
using CompanionFiles = std::function<std::optional<std::string>(const std::filesystem::path&)>;

/// As ReadMesh, for bytes in memory; `name` stands for the file.
MeshFile ParseMesh(std::string_view bytes, const std::filesystem::path& name, const CompanionFiles& companions = {});

/// The file's triangles or, where it has tetrahedra, their boundary seen from outside.
TriangleMesh SurfaceOf(MeshFile mesh);

}  // namespace fulcrum::scene
