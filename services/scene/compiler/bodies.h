// The further deformable bodies of a scene.
#pragma once

#include "services/scene/builder/build.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/placement.h"

namespace fulcrum::scene {

/// Appends `settings.bodies` to `anatomy`, placed like the organ. Throws InputError naming the body.
void AddBodies(const SceneSettings& settings, const Placement& placement, const Progress& progress, Anatomy* anatomy);

}  // namespace fulcrum::scene
