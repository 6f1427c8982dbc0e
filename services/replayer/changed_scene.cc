#include "services/replayer/changed_scene.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "services/core/error.h"
#include "services/scene/scene_yaml.h"

namespace fulcrum::replay {
namespace {

constexpr std::array<std::string_view, 4> kSections{"physics", "thermal", "haptics", "breathing"};

}  // namespace

SceneView WithChanges(const scene::SceneFile& scene, const std::vector<std::string>& changes) {
  YAML::Node description;
  try {
    description = YAML::Load(scene.source_yaml());
  } catch (const YAML::Exception& error) {
    throw InputError(std::string("--set: the description inside the compiled scene cannot be read: ") + error.what());
  }
  for (const std::string& change : changes) {
    const std::size_t dot = change.find('.'), equals = change.find('=');
    const bool whole = dot != std::string::npos && equals != std::string::npos && dot > 0 && dot + 1 < equals &&
                       equals + 1 < change.size();
    const std::string section = whole ? change.substr(0, dot) : std::string();
    if (std::find(kSections.begin(), kSections.end(), section) == kSections.end()) {
      throw InputError("--set " + change +
                       ": must be section.key=value with a section of physics, thermal, haptics, breathing; for "
                       "example physics.grip_force_N=5");
    }
    try {
      description[section][change.substr(dot + 1, equals - dot - 1)] = YAML::Load(change.substr(equals + 1));
    } catch (const YAML::Exception& error) {
      throw InputError("--set " + change + ": " + error.what());
    }
  }
  YAML::Emitter text;
  text << description;
  const scene::SceneSettings settings =
      scene::ParseSceneYaml(text.c_str(), "the scene with --set applied", {}).settings;
  SceneView changed = scene.view();
  changed.physics = settings.physics;
  changed.thermal = settings.thermal;
  changed.haptics = settings.haptics;
  changed.breathing = settings.breathing;
  return changed;
}

}  // namespace fulcrum::replay
