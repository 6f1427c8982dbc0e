// The YAML description of a scene: every key is documented in services/scene/README.md.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/scene/builder/scene_settings.h"

namespace fulcrum::scene {

struct SceneDescription {
  SceneSettings settings;
  std::string effective_yaml;          ///< The values read, defaults included. Reading it gives the same settings.
  std::vector<config::KeyRule> rules;  ///< Every key that was read.
};

/// Reads and checks a scene description. Mesh files are searched in `data` (when not empty), then in the folders that
/// the description names. `changes`: see ApplyChanges. Throws InputError "file:line: key: reason; valid: range".
SceneDescription ReadSceneYaml(const std::filesystem::path& file, const std::filesystem::path& data,
                               const std::vector<std::string>& changes = {});

/// Whether the mesh files that a description names must exist.
enum class MeshFiles { kNeeded, kNotRead };

/// As ReadSceneYaml, for a text; `name` stands for the file in messages, relative folders refer to the working
/// directory.
SceneDescription ParseSceneYaml(std::string_view text, std::string_view name, const std::filesystem::path& data,
                                MeshFiles files = MeshFiles::kNeeded);

/// True if a scene may have this name, which becomes a part of the names of files and folders.
[[nodiscard]] bool IsSceneName(std::string_view name);
inline constexpr const char* kSceneNameRule = "up to 63 letters, digits, '-', '_' and '.', the first no '.'";

/// Every key that a description can have. Its mesh files need not exist.
std::vector<config::KeyRule> SceneRules(const std::filesystem::path& file);

struct SceneSummary {
  std::string name, description;
  std::filesystem::path file;
};
/// Name and description of each *.yaml in a folder, sorted by file; nothing else of them is checked. Throws InputError.
std::vector<SceneSummary> ListScenes(const std::filesystem::path& folder);

}  // namespace fulcrum::scene
