// Reading the deformable bodies and sheets of a scene description: shapes, `bodies`, `sheets`, `regions`, `attach`,
// `fixed`.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/scene/builder/scene_settings.h"
#include "services/scene/compiler/materials.h"

namespace fulcrum::scene {

/// Points of a line from `x_mm`, `y_mm` and `z_mm`, at least two and at most 64 [m].
std::vector<Vec3f> ReadLine(config::StrictMap* map);

/// `ellipsoid_mm`, or `x_mm`, `y_mm`, `z_mm` and `radius_mm`. Throws InputError, as all functions here.
ShapeSettings ReadShape(config::StrictMap map);

/// Names of the roles of fixed surfaces.
inline const config::StrictMap::Choices<SurfaceRole> kSurfaceRoles = {
    {"abdominal_wall", SurfaceRole::kAbdominalWall},
    {"retroperitoneum", SurfaceRole::kRetroperitoneum},
    {"pelvis", SurfaceRole::kPelvis},
    {"bladder", SurfaceRole::kBladder},
    {"other", SurfaceRole::kOther}};

/// Metres per unit of a mesh file.
inline const config::StrictMap::Choices<double> kLengthUnits = {{"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}};

/// `unit` of a mesh file beside the organ [metres per unit]; 0: that of `import`.
double ReadFileUnit(config::StrictMap* map);

/// The word for a role in a description.
std::string_view RoleName(SurfaceRole role);
/// The role that a word names. Throws InputError.
SurfaceRole RoleNamed(const std::string& name);
/// Metres per unit m, cm, mm or um. Throws InputError for another one.
double LengthUnit(const std::string& name);

/// Path of the file that a key names.
using FindMesh = std::function<std::filesystem::path(const config::StrictMap&, const std::string& key)>;

/// What every fixed surface has: `name`, `role`, `offset_mm`, `triangles_max`, `collides`.
FixedSettings ReadFixedSurface(config::StrictMap* map);

/// `bodies`, `sheets`, `regions`, `attach` and `fixed` of a description, whose organ is known.
/// @return the maps of the sheets, for what depends on later sections.
std::vector<config::StrictMap> ReadBodies(config::StrictMap* root, const FindMesh& find,
                                          const MaterialLibrary& materials, SceneSettings* scene);

}  // namespace fulcrum::scene
