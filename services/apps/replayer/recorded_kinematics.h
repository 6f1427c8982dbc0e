// The samples of a recording from which a set for robot learning takes its rows.
#pragma once

#include <filesystem>

#include "services/apps/replayer/kinematics.h"
#include "services/apps/replayer/session_facts.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

/// What a recording shows; reads little of it. Throws InputError for a recording without session and MismatchError for
/// one of another scene.
[[nodiscard]] RecordedSpan ReadSpan(const std::filesystem::path& recording, const SceneView& scene);

/// Reads the samples until session time `until_s` [s] without drawing, and skips those that a node would have refused:
/// outside the gate, of a writer that was replaced, or of a time after that at which they were recorded. Throws
/// InputError, with what to do, for a recording without session, poses or tissue, and MismatchError for one of another
/// scene.
[[nodiscard]] Kinematics ReadKinematics(const std::filesystem::path& recording, const SceneView& scene, double until_s);

}  // namespace fulcrum::replay
