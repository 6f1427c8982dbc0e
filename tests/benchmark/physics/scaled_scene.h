// A flat sheet over a tube at the density of the built-in scene, with any multiple of its particles: no bindings, no
// hinges, no tools.
#pragma once

#include "services/scene/format/scene_file.h"

namespace fulcrum::physics {

/// `factor` times the 20,560 particles of the built-in scene; preset default, the sheet as springs or as triangles by
/// the default of PhysicsParams.
[[nodiscard]] scene::SceneData MakeScaledScene(double factor);

}  // namespace fulcrum::physics
