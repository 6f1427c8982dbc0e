#include "services/scene/import.h"

#include "services/core/error.h"

namespace fulcrum::scene {

Anatomy ImportAnatomy(const SceneSettings& settings, const Progress&) {
  throw InputError("scene '" + settings.name + "': meshes cannot be imported yet");
}

}  // namespace fulcrum::scene
