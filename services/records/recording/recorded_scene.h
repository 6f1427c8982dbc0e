// The scene to which a recording belongs.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "services/base/core/error.h"
#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::recording {

/// The path `given`, or if it is empty the file beside the recording in its session's folder. Empty: there is none.
[[nodiscard]] inline std::filesystem::path BesideRecording(const std::string& given,
                                                           const std::filesystem::path& recording, const char* name) {
  if (!given.empty()) return given;
  const std::filesystem::path beside = recording.parent_path() / name;
  return std::filesystem::exists(beside) ? beside : std::filesystem::path();
}

/// Throws MismatchError if the recorded session used another scene.
inline void RefuseOtherScene(const std::filesystem::path& recording, const std::optional<SceneManifest>& session,
                             const SceneView& scene) {
  if (!session || session->scene_hash == scene.hash) return;
  throw MismatchError(recording.string() + " was recorded with another scene (\"" + session->scene_name +
                      "\"): give the compiled scene of that session with --scene");
}

}  // namespace fulcrum::recording
