#include "services/apps/replayer/changed_scene.h"

#include <array>
#include <string_view>

#include "services/scene/compiler/changes.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::replay {
namespace {

constexpr std::array<std::string_view, 4> kSections{"physics", "thermal", "haptics", "breathing"};

}  // namespace

SceneView WithChanges(const scene::SceneFile& scene, const std::vector<std::string>& changes) {
  const std::string text = scene::ApplyChanges(scene.source_yaml(), changes, kSections);
  const scene::SceneSettings settings = scene::ParseSceneYaml(text, "the scene with --set applied", {}).settings;
  SceneView changed = scene.view();
  changed.physics = settings.physics;
  changed.thermal = settings.thermal;
  changed.haptics = settings.haptics;
  changed.breathing = settings.breathing;
  return changed;
}

}  // namespace fulcrum::replay
