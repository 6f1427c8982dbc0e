// Assessment of a recorded session, with the same figures as live.
#pragma once

#include <filesystem>
#include <string>

#include "services/base/core/scene_view.h"
#include "services/session/assessment/score.h"

namespace fulcrum::assessment {

struct RecordedAssessment {
  std::string session_id;
  double end_s = 0;  ///< Session time of the end [s]; where the recording lacks it, that of the last message.
  Figures figures;
};

/// Assesses the first session of a recording. Throws InputError (no recording, no session in it, a scene without the
/// section `assessment`) or MismatchError (a recording of another scene).
[[nodiscard]] RecordedAssessment AssessRecording(const std::filesystem::path& recording, const SceneView& scene);

}  // namespace fulcrum::assessment
