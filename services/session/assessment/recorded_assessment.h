// A recorded session, measured as it was when it was live.
#pragma once

#include <filesystem>
#include <string>

#include "services/base/core/scene_view.h"
#include "services/session/assessment/score.h"

namespace fulcrum::assessment {

struct RecordedAssessment {
  std::string session_id;
  double end_s = 0;  ///< Session time at which the supervisor ended it; of the last message where it does not tell.
  Figures figures;
};

/// Throws InputError (no recording, no session in it, a scene without the section `assessment`) or MismatchError (a
/// recording of another scene).
[[nodiscard]] RecordedAssessment AssessRecording(const std::filesystem::path& recording, const SceneView& scene);

}  // namespace fulcrum::assessment
