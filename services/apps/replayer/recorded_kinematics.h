// The samples of a recording from which a set for robot learning takes its rows.
#pragma once

#include <filesystem>

#include "services/apps/replayer/kinematics.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

struct RecordedKinematics {
  Kinematics kinematics;
  double end_s = 0;  ///< Session time of the last message [s].
};

/// Reads the whole recording without drawing, and skips the samples that a node would have refused: outside the gate,
/// of a writer that was replaced, or of a time after that at which they were recorded. Throws InputError, with what to
/// do, for a recording without session, poses or tissue, and MismatchError for one of another scene.
[[nodiscard]] RecordedKinematics ReadKinematics(const std::filesystem::path& recording, const SceneView& scene);

}  // namespace fulcrum::replay
