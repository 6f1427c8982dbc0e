// From a description file to a compiled scene: the work of the scene_compiler program.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::scene {

/// Called with a text at the start of each stage; may be empty.
using Progress = std::function<void(const std::string&)>;

/// Builds a procedural or imported scene, depending on the settings. Throws InputError.
SceneData BuildScene(const SceneSettings& settings, const Progress& progress);

struct CompiledScene {
  SceneData data;
  std::string effective_yaml;
};
/// Reads the YAML, with `changes` applied (ApplyChanges), and builds the scene. Throws InputError.
CompiledScene CompileScene(const std::filesystem::path& yaml, const std::filesystem::path& data,
                           const Progress& progress, const std::vector<std::string>& changes = {});

}  // namespace fulcrum::scene
