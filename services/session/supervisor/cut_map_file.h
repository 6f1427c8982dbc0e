// The map of what a recorded session has cut, beside its report.
#pragma once

#include <filesystem>

#include "services/base/core/scene_view.h"

namespace fulcrum::supervisor {

/// Writes cut.png and cut.json into `folder` and returns the path of the picture. Returns an empty path, without an
/// error, when the recording cannot be read or is so long that reading would delay the report, when the scene has no
/// hook, or when nothing was cut.
[[nodiscard]] std::filesystem::path WriteCutMap(const std::filesystem::path& recording, const SceneView& scene,
                                                const std::filesystem::path& folder);

}  // namespace fulcrum::supervisor
