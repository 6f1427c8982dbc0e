// What a recording shows of clips and blood, by the messages that the picture is made of, however many pictures there
// were.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "services/base/core/scene_view.h"

namespace fulcrum::testing {

struct ClipOutcome {
  std::uint32_t clips = 0;  ///< On the tissue at the end.
  std::size_t cuts = 0;     ///< ThermalEvents.
  double shed_m3 = 0;       ///< Blood until a second after the last message.
};

/// @param scene of the recording. Throws as log_tools::Recording does.
[[nodiscard]] ClipOutcome FollowClips(const SceneView& scene, const std::filesystem::path& recording);

}  // namespace fulcrum::testing
