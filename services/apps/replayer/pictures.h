// The pictures of a recorded session, drawn again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

struct PicturesSettings {
  std::filesystem::path recording;
  std::filesystem::path frames;  ///< Folder for the pictures.
  double until_s = -1;           ///< Session time; negative: to the end.
};

struct PicturesResult {
  std::uint64_t written = 0;
  std::vector<Metric> health;  ///< As the node tells them at the end.
};

/// Lets the class of render_node draw the recorded topics at the scene's rate of pictures, on the clock of the
/// recording, at high quality: the same pictures each time. Throws InputError,
/// MismatchError, std::runtime_error when OpenGL is missing.
PicturesResult ReplayPictures(const PicturesSettings& settings, const SceneView& scene,
                              const std::function<void(double)>& progress);

}  // namespace fulcrum::replay
