// The further deformable bodies and sheets of a scene.
#pragma once

#include "services/scene/builder/build.h"
#include "services/scene/compiler/compile.h"
#include "services/scene/compiler/placement.h"

namespace fulcrum::scene {

/// Appends `settings.bodies` to `anatomy`, placed like the organ. Throws InputError naming the body.
void AddBodies(const SceneSettings& settings, const Placement& placement, const Progress& progress, Anatomy* anatomy);

/// Appends fixed surfaces to `anatomy`, placed like the organ. Throws InputError naming the surface.
void AddFixed(const std::vector<FixedSettings>& surfaces, const SceneSettings& settings, const Placement& placement,
              const Progress& progress, Anatomy* anatomy);

/// Appends `settings.sheets`, after the bodies that they lie over. Throws InputError naming the sheet.
void AddSheets(const SceneSettings& settings, const Placement& placement, const Progress& progress, Anatomy* anatomy);

}  // namespace fulcrum::scene
