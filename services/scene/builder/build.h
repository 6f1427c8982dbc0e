// From settings to a scene. The stages are pure functions of their input: the same settings give the same bytes.
#pragma once

#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::scene {

/// Builds the procedural scene that `settings` (without `import` and `bodies`) describes. Throws InputError when the
/// settings do not give a scene: too many vertices, a sheet larger than the atlas, an inverted tetrahedron, a script
/// out of reach.
SceneData BuildProcedural(const SceneSettings& settings);

/// A deformable body of tetrahedra, and its visible surface.
struct SolidBody {
  std::string name;
  Material material;
  std::vector<Vec3d> vertices;
  std::vector<Tetrahedron> tets;
  std::vector<bool> fixed;              ///< [vertices]
  std::vector<Vec3d> surface_vertices;  ///< High-resolution surface, to be embedded.
  std::vector<Triangle> surface_triangles;
};

/// A sheet of rows x columns nodes.
struct SheetBody {
  std::string name;
  MembraneSettings grid;
  std::vector<Vec3d> nodes;                  ///< Row by row.
  Index over = kNoIndex;                     ///< Number of the solid to which it is bound; none: to all within reach.
  bool ends_held = true, sides_held = true;  ///< First and last row, first and last column.
  SheetProperties own{};                     ///< 0: that of the scene.
  SheetHeat heat = {};                       ///< Likewise.
};

/// Throws InputError with the name of the scene.
[[noreturn]] void Refuse(const SceneSettings& settings, const std::string& text);

/// The bodies and their surroundings, procedural or imported.
struct Anatomy {
  std::vector<SolidBody> solids;  ///< The first is the organ under the membrane, if there is one.
  std::vector<SheetBody> sheets;  ///< The first is the membrane, if there is an organ.
  bool is_patch = false;          ///< The sheet covers a patch, not a stretch of a tube.
  /// Frame W in the frame of the description's bodies: p_W = R_WF (p_F - origin_m).
  Mat3d R_WF = Mat3d::Identity();
  Vec3d origin_m = Vec3d::Zero();
  struct Surrounding {
    std::string name;
    SurfaceRole role;
    bool collides;
    std::vector<Vec3d> vertices;
    std::vector<Triangle> triangles;  ///< Facing the cavity.
  };
  std::vector<Surrounding> surroundings;
};

/// The organ with the density and stiffness of the settings, still without shape.
SolidBody OrganOf(const SceneSettings& settings);
/// The membrane over it.
SheetBody MembraneOf(const SceneSettings& settings, std::vector<Vec3d> nodes);

/// Anatomy of a procedural scene, without `bodies`.
Anatomy ProceduralAnatomy(const SceneSettings& settings);

/// Masses, constraints, colours, bindings, attachments, embedding, material coordinates, structures and script over an
/// anatomy.
SceneData AssembleScene(const SceneSettings& settings, const Anatomy& anatomy);

}  // namespace fulcrum::scene
