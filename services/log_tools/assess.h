// A recorded session, measured as it was when it was live.
#pragma once

#include <filesystem>
#include <string>

#include "services/assessment/score.h"
#include "services/core/scene_view.h"

namespace fulcrum::log_tools {

struct RecordedAssessment {
  std::string session_id;
  double end_s = 0;  ///< Session time at which the supervisor ended it; of the last message where it does not tell.
  assessment::Figures figures;
};

/// Throws InputError (no recording, no session in it, a scene without the section `assessment`) or MismatchError (a
/// recording of another scene).
[[nodiscard]] RecordedAssessment Assess(const std::filesystem::path& recording, const SceneView& scene);

}  // namespace fulcrum::log_tools
