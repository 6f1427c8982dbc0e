// The smallest valid procedural scene.
#pragma once

#include "services/scene/builder/scene_settings.h"

namespace fulcrum::fuzz {

[[nodiscard]] inline scene::SceneSettings TinyScene() {
  scene::SceneSettings settings = scene::Small();
  settings.tube.rings = 4;
  settings.tube.segments = 6;
  settings.membrane.rows = 9;
  settings.membrane.cols = 9;
  return settings;
}

}  // namespace fulcrum::fuzz
