// The compiled file of a scene that the user names, from a cache or compiled now.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::supervisor {

struct SceneRequest {
  std::string name;                  ///< A name in `library`, a .yaml file, or a compiled file.
  std::filesystem::path data;        ///< Folder of the meshes that the scene imports; empty: the scene's own folder.
  std::vector<std::string> changes;  ///< Parameters that replace those of the description: SECTION.KEY=VALUE.
  std::filesystem::path library;     ///< Folder of the shipped scenes.
  std::filesystem::path compiler;    ///< Program scene_compiler.
  std::filesystem::path cache;       ///< Folder of compiled scenes.
  bool for_services = false;         ///< systemd hides some folders from them.
};

/// Versions of one scene that the cache keeps, the last used ones: those of some changes and back again.
inline constexpr std::size_t kKeptVersions = 8;

/// The compiled file: the named file when it is compiled already, else the cached one, else one that is compiled now,
/// which may take minutes for real anatomy and removes all but kKeptVersions of that scene from the cache (a session
/// has a link or copy of its own). Throws InputError when there is no such scene or it does not compile.
[[nodiscard]] std::filesystem::path ResolveScene(const SceneRequest& request);

/// Names of the shipped scenes.
[[nodiscard]] std::vector<std::string> ShippedScenes(const std::filesystem::path& library);

}  // namespace fulcrum::supervisor
