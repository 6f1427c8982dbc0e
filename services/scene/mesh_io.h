// Reads triangle meshes from files that others wrote. Nothing in a file is believed: sizes are checked against the
// bytes that are there, before any memory is asked for.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "services/core/types.h"

namespace fulcrum::scene {

/// Vertices in the file's own unit. Triangles without area may be among them; indices are in range, vertices finite.
struct TriangleMesh {
  std::vector<Vec3d> vertices;
  std::vector<Triangle> triangles;
};

inline constexpr std::size_t kMaxMeshTriangles = 5'000'000;

/// Reads .stl (binary or ASCII; equal corners become one vertex) or .obj (polygons are split into fans).
/// Throws InputError "file: reason".
TriangleMesh ReadMesh(const std::filesystem::path& file);

/// The same for bytes in memory; `name` stands for the file, its extension says the format.
TriangleMesh ParseMesh(std::string_view bytes, const std::filesystem::path& name);

}  // namespace fulcrum::scene
