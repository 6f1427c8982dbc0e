// Meshes of the tools of a scene, transformed into frame T.
#pragma once

#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::scene {

/// Reads the meshes that `settings` names, adds them to `scene` and updates its hash. No effect if none is named.
/// Throws InputError "file: reason" for a file that cannot be read, has too many triangles for an instrument or extends
/// farther than an instrument does (wrong unit).
void AddToolMeshes(const SceneSettings& settings, SceneData* scene);

}  // namespace fulcrum::scene
