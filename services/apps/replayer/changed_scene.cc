#include "services/apps/replayer/changed_scene.h"

#include <array>
#include <string_view>

#include "services/scene/compiler/changes.h"
#include "services/scene/compiler/scene_yaml.h"

namespace fulcrum::replay {
namespace {

constexpr std::array<std::string_view, 4> kSections{"physics", "thermal", "haptics", "breathing"};

}  // namespace

SceneView WithChanges(const scene::SceneFile& scene, const std::vector<std::string>& changes,
                      std::vector<Solid>* solids) {
  const std::string text = scene::ApplyChanges(scene.source_yaml(), changes, kSections);
  const scene::SceneSettings settings =
      scene::ParseSceneYaml(text, "the scene with --set applied", {}, scene::MeshFiles::kNotRead).settings;
  SceneView changed = scene.view();
  changed.physics = settings.physics;
  changed.thermal = settings.thermal;
  changed.haptics = settings.haptics;
  changed.breathing = settings.breathing;
  solids->assign(changed.solids.begin(), changed.solids.end());
  // The modulus of the organ is that of `physics`, also where the scene lists its solids.
  if (settings.has_organ && !solids->empty()) {
    solids->front().youngs_modulus_Pa = settings.physics.tube_youngs_modulus_Pa;
  }
  changed.solids = *solids;
  return changed;
}

}  // namespace fulcrum::replay
