// Drawing of the pictures of a recorded session.
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
  double until_s = -1;           ///< Session time of the end [s]; negative: the end of the recording.
};

struct PicturesResult {
  std::uint64_t written = 0;
  std::vector<Metric> health;  ///< Metrics of the node's Health at the end.
};

/// Draws the recorded topics with the class of render_node at the scene's rate of pictures, on the clock of the
/// recording and at high quality, so that all runs give the same pictures. Throws InputError, MismatchError, and
/// std::runtime_error when OpenGL is missing or a picture could not be written.
PicturesResult ReplayPictures(const PicturesSettings& settings, const SceneView& scene,
                              const std::function<void(double)>& progress);

}  // namespace fulcrum::replay
