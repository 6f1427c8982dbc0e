// From a description file to a compiled scene: what the scene_compiler program does.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "services/scene/builder/scene_settings.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::scene {

/// Called with what begins now; may be empty.
using Progress = std::function<void(const std::string&)>;

/// Procedural or imported, as the settings say. Throws InputError.
SceneData BuildScene(const SceneSettings& settings, const Progress& progress);

struct CompiledScene {
  SceneData data;
  std::string effective_yaml;
};
/// Reads the YAML, with `changes` made (ApplyChanges), and builds the scene. Throws InputError.
CompiledScene CompileScene(const std::filesystem::path& yaml, const std::filesystem::path& data,
                           const Progress& progress, const std::vector<std::string>& changes = {});

}  // namespace fulcrum::scene
