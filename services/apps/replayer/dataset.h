// A recorded session as a data set: pictures with the ground truth of each pixel, poses of camera and instruments.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

struct DatasetSettings {
  std::filesystem::path recording;
  std::filesystem::path folder;  ///< Must be empty or missing.
  double until_s = -1;           ///< Session time of the end [s]; negative: the end of the recording.
  double every_s = 0.2;          ///< Session time between two pictures [s].
  double baseline_m = 0.005;     ///< Distance of the right camera from the left one [m]; 0: no right pictures.
  std::uint32_t variations = 0;  ///< Data sets of the same session with another look each; 0: one, as it was.
  std::uint32_t seed = 1;        ///< Of the variations.
};

struct DatasetResult {
  std::uint64_t frames = 0;
  double duration_s = 0;  ///< Session time covered [s].
};

/// Writes the data set, or with variations one in each folder 000, 001 and so on; its layout is in
/// deploy/docs/dataset.md. The same recording gives the same files to the last byte on one machine. Throws InputError,
/// MismatchError, and std::runtime_error when OpenGL is missing or the recording has no tissue.
DatasetResult MakeDataset(const DatasetSettings& settings, const SceneView& scene,
                          const std::function<void(double)>& progress);

}  // namespace fulcrum::replay
