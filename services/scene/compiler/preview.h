// Pictures of a compiled scene from four sides, and of the place where an import failed.
#pragma once

#include <string>

#include "services/base/core/scene_view.h"
#include "services/scene/compiler/spot.h"

namespace fulcrum::scene {

/// PNG: organ, membrane, surroundings, tools and the paths of their tips at rest, as the scope sees them, from above
/// (z), from the patient's left (x) and from caudal (-y). Fixed parts of the organ are grey.
std::string PreviewOf(const SceneView& scene);

/// PNG: the whole and the surroundings of the place, each from two sides.
std::string PictureOf(const Spot& spot);

}  // namespace fulcrum::scene
