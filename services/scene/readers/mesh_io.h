// Reads meshes from files that others wrote: Gmsh, VTK legacy, VTU, TetGen, STL, OBJ, PLY. Nothing in a file is
// believed: sizes are checked against the bytes that are there, before any memory is asked for.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::scene {

/// Vertices in the file's own unit. Triangles without area may be among them; indices are in range, vertices finite.
struct TriangleMesh {
  std::vector<Vec3d> vertices;
  std::vector<Triangle> triangles;
};

/// What a file holds: triangles (polygons are split into fans), tetrahedra (in the file's own orientation), or both.
/// Points and lines are counted and left out. Cells that would leave a hole when left out (hexahedra, prisms, pyramids,
/// anything of second order) are refused.
struct MeshFile {
  std::vector<Vec3d> vertices;
  std::vector<Triangle> triangles;
  std::vector<Tetrahedron> tets;
  std::size_t skipped = 0;  ///< Points and lines.
};

inline constexpr std::size_t kMaxMeshElements = 10'000'000;  ///< Of vertices, and of elements.
inline constexpr std::size_t kMaxMeshBytes = 2'000'000'000;  ///< Of a file.

/// Chooses the format by the file's first bytes, and where they do not tell by its extension. A TetGen file brings its
/// companion: .ele and .face their .node; .node its .ele, else its .face. Throws InputError "file: place: reason".
MeshFile ReadMesh(const std::filesystem::path& file);

/// Bytes of a companion file; none when there is no such file.
using CompanionFiles = std::function<std::optional<std::string>(const std::filesystem::path&)>;

/// The same for bytes in memory; `name` stands for the file.
MeshFile ParseMesh(std::string_view bytes, const std::filesystem::path& name, const CompanionFiles& companions = {});

/// The file's triangles or, where it has tetrahedra, their boundary seen from outside.
TriangleMesh SurfaceOf(MeshFile mesh);

}  // namespace fulcrum::scene
