// The folder of one session: out/<session>/ with logs/, frames/, scene, cart, configuration.
#pragma once

#include <filesystem>
#include <string>

#include "services/base/config/cart.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::supervisor {

struct SessionFolder {
  std::filesystem::path path, logs, frames, scene, cart;
  std::string session_id;     ///< Name of the folder.
  std::string started_utc;    ///< For people.
  std::string configuration;  ///< Effective configuration, YAML; also in configuration.yaml.
};

/// Makes it under `out`, named after time and scene, and points out/latest to it. `run_yaml`: how the session was
/// started, as indented YAML. Throws InputError when something cannot be written.
[[nodiscard]] SessionFolder MakeSessionFolder(const std::filesystem::path& out, const std::filesystem::path& scene_file,
                                              const scene::SceneFile& scene, const config::CartConfig& cart,
                                              const std::string& run_yaml);

/// Removes the nodes' checkpoints: they are for restarts within the session, and large.
void RemoveCheckpoints(const SessionFolder& folder);
/// Makes `link` point to `folder`, whatever it was, in one step. Throws InputError.
void PointTo(const std::filesystem::path& link, const std::filesystem::path& folder);

/// Throws InputError that names the file.
void WriteFile(const std::filesystem::path& file, const std::string& text);

/// CPU model and count, for people.
[[nodiscard]] std::string DescribeMachine();

}  // namespace fulcrum::supervisor
