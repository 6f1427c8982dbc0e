// A recorded session as a film: the picture of any time, drawn when another program asks for it.
#pragma once

#include <filesystem>
#include <iosfwd>

#include "services/base/core/scene_view.h"

namespace fulcrum::replay {

/// Shows a recording to a program. Writes "end TIME" and then, for each line with a session time [s] on `in`,
/// "TIME BYTES" and a JPEG file of BYTES bytes (0: the picture has not changed). Returns at the end of `in`. Throws
/// InputError for a line that is no time, and what Projector throws.
void ShowFilm(const std::filesystem::path& recording, const SceneView& scene, std::istream& in, std::ostream& out);

}  // namespace fulcrum::replay
