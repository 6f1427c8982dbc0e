// How the tools of a scene look: their mesh files, brought into frame T.
#pragma once

#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::scene {

/// Reads the meshes that `settings` names and adds them to `scene`, whose hash follows. Nothing happens where none is
/// named. Throws InputError "file: reason" for a file that cannot be read, has too many triangles for an instrument or
/// reaches farther than one does (the unit is wrong).
void AddToolMeshes(const SceneSettings& settings, SceneData* scene);

}  // namespace fulcrum::scene
