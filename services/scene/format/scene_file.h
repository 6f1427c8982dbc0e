// The compiled scene file: versioned, checksummed, memory-mapped read-only by every node.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "services/base/core/hash.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::scene {

inline constexpr std::uint32_t kSceneFileVersion = 16;
/// Version of what the content hash is taken of; another one changes the hash of every scene.
inline constexpr std::uint32_t kSceneContentVersion = 12;

/// Owns the arrays of a scene under construction or in a test; `View()` is what nodes read.
struct SceneData {
  SceneView fixed;  ///< Name, parameters, counts, tools: everything that is not a span. Spans in it are ignored.
  std::vector<Vec3f> rest_position;
  std::vector<float> inverse_mass;
  std::vector<Tetrahedron> tets;
  std::vector<Index> tet_colours;
  std::vector<StretchConstraint> tube_edges;
  std::vector<Index> tube_edge_colours;
  std::vector<float> membrane_rest_length;
  std::vector<BendingConstraint> bending;
  std::vector<Index> bending_colours;
  std::vector<Binding> bindings;
  std::vector<Index> binding_colours;
  std::vector<Triangle> tube_surface;
  std::vector<Solid> solids;
  std::vector<Attachment> attachments;
  std::vector<SheetPart> sheets;
  std::vector<EmbeddedVertex> surface_vertices;
  std::vector<Triangle> surface_triangles;
  std::vector<Vec2f> membrane_material;
  std::vector<StaticSurface> static_surfaces;
  std::vector<Vec3f> static_vertices;
  std::vector<Triangle> static_triangles;
  std::vector<ProtectedStructure> protected_structures;
  std::vector<ProtectedPoint> protected_points;
  std::vector<ToolMesh> tool_meshes;
  std::vector<Vec3f> tool_vertices;
  std::vector<Triangle> tool_triangles;
  std::vector<ScriptKey> script;
  std::vector<Vec2f> planned_line;

  [[nodiscard]] SceneView View() const;
};

/// Hash of everything except the source text: for nodes, two scenes with the same hash are the same.
[[nodiscard]] std::uint64_t ContentHash(const SceneView& view);
/// What it takes of attachments: normals only if there are any, so that scenes without keep their hash.
void AddToHash(std::span<const Attachment> attachments, Hash64* hash);
/// Likewise of sheets: what concerns heat only if one has values of its own.
void AddToHash(std::span<const SheetPart> sheets, Hash64* hash);

/// Checks the scene and writes it atomically (temporary file, then rename). Returns the content hash.
/// Throws InputError.
std::uint64_t WriteSceneFile(const SceneView& scene, const std::string& source_yaml, const std::filesystem::path& file);
std::uint64_t WriteSceneFile(const SceneData& scene, const std::string& source_yaml, const std::filesystem::path& file);

class SceneFile {
 public:
  /// Maps the file and checks magic, version, size, checksum of each section, range of every index, and that every
  /// number is finite. Throws InputError naming file, section and reason (MismatchError for another version).
  explicit SceneFile(const std::filesystem::path& file);
  ~SceneFile();
  SceneFile(const SceneFile&) = delete;
  SceneFile& operator=(const SceneFile&) = delete;

  [[nodiscard]] const SceneView& view() const;
  /// The effective YAML from which the scene was compiled.
  [[nodiscard]] std::string source_yaml() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::scene
