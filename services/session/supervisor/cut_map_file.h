// The map of what a recorded session has cut, beside its report.
#pragma once

#include <filesystem>

#include "services/base/core/scene_view.h"

namespace fulcrum::supervisor {

/// Writes cut.png and cut.json into `folder` and returns the picture. Empty, without a word: no recording that can be
/// read, one so long that reading it would hold the report up, no hook, or nothing was cut.
[[nodiscard]] std::filesystem::path WriteCutMap(const std::filesystem::path& recording, const SceneView& scene,
                                                const std::filesystem::path& folder);

}  // namespace fulcrum::supervisor
