// A scene from meshes of real anatomy: the organ's surface is repaired, filled with tetrahedra and draped with a
// membrane.
#pragma once

#include "services/scene/builder/build.h"
#include "services/scene/compiler/compile.h"

namespace fulcrum::scene {

/// Reads `settings.import`'s meshes and builds the anatomy in frame W. The organ is a filled body.
/// Throws InputError naming the file: not closed, not one piece, folded over, too many vertices.
Anatomy ImportAnatomy(const SceneSettings& settings, const Progress& progress);

}  // namespace fulcrum::scene
