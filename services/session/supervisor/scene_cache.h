// From what the user calls a scene to a compiled file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::supervisor {

struct SceneRequest {
  std::string name;                  ///< A name of `library`, a .yaml file, or a compiled file.
  std::filesystem::path data;        ///< Folder of the meshes that the scene imports; empty: the scene's own.
  std::vector<std::string> changes;  ///< Parameters other than in the description: SECTION.KEY=VALUE.
  std::filesystem::path library;     ///< Folder of the shipped scenes.
  std::filesystem::path compiler;    ///< Program scene_compiler.
  std::filesystem::path cache;       ///< Compiled scenes are kept here.
};

/// The compiled file: what was asked for, when it is one; else from the cache; else compiled now, which may take
/// minutes for real anatomy. Throws InputError when there is no such scene or it does not compile.
[[nodiscard]] std::filesystem::path ResolveScene(const SceneRequest& request);

/// Names of the shipped scenes.
[[nodiscard]] std::vector<std::string> ShippedScenes(const std::filesystem::path& library);

}  // namespace fulcrum::supervisor
