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
  std::string started_utc;    ///< Start, as "2024-05-01 12:34:56 UTC".
  std::string configuration;  ///< Effective configuration, YAML; also in configuration.yaml.
};

/// Makes the folder (mode 0700) under `out`, named after time and scene, and points out/latest to it. `run_yaml`
/// contains the options of the start as indented YAML. Throws InputError when something cannot be written.
[[nodiscard]] SessionFolder MakeSessionFolder(const std::filesystem::path& out, const std::filesystem::path& scene_file,
                                              const scene::SceneFile& scene, const config::CartConfig& cart,
                                              const std::string& run_yaml);

/// Removes the nodes' checkpoints, which are large and serve restarts within the session only.
void RemoveCheckpoints(const SessionFolder& folder);
/// Makes `link` point to `folder` atomically and replaces an earlier link. Throws InputError.
void PointTo(const std::filesystem::path& link, const std::filesystem::path& folder);

/// Writes `file`, a new one with mode 0600; throws an InputError that names it when that fails.
void WriteFile(const std::filesystem::path& file, const std::string& text);

/// CPU model and number of hardware threads, for the report.
[[nodiscard]] std::string DescribeMachine();

}  // namespace fulcrum::supervisor
