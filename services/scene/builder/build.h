// From settings to a scene. The stages are pure functions of their input: the same settings give the same bytes.
#pragma once

#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::scene {

/// Builds the procedural scene that `settings` (without `import`) describes. Throws InputError when the settings do not
/// give a scene: too many vertices, a sheet larger than the atlas, an inverted tetrahedron, a script out of reach.
SceneData BuildProcedural(const SceneSettings& settings);

/// The organ and its surroundings, procedural or imported.
struct Anatomy {
  std::vector<Vec3d> organ_vertices;
  std::vector<Tetrahedron> tets;
  std::vector<bool> organ_fixed;        ///< [organ_vertices]
  std::vector<Vec3d> surface_vertices;  ///< High-resolution surface, to be embedded.
  std::vector<Triangle> surface_triangles;
  std::vector<Vec3d> sheet;  ///< Membrane nodes, row by row.
  bool is_patch = false;     ///< The sheet covers a patch, not a stretch of a tube.
  struct Surrounding {
    std::string name;
    SurfaceRole role;
    bool collides;
    std::vector<Vec3d> vertices;
    std::vector<Triangle> triangles;  ///< Facing the cavity.
  };
  std::vector<Surrounding> surroundings;
};

/// Masses, constraints, colours, bindings, embedding, material coordinates, structures and script over an anatomy.
SceneData AssembleScene(const SceneSettings& settings, const Anatomy& anatomy);

}  // namespace fulcrum::scene
