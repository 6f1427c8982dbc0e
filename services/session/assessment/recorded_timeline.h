// The time line of a recorded session.
#pragma once

#include <filesystem>
#include <stop_token>
#include <vector>

#include "services/session/assessment/timeline.h"

namespace fulcrum::assessment {

struct RecordedTimeline {
  std::vector<Happening> happenings;
  std::size_t left_out = 0;  ///< Number of those beyond Timeline::kMost.
};

/// Reads the first session of a recording, up to `stop`; with forces and slips where the compiled scene is beside it.
/// Throws InputError (no recording, no session in it).
[[nodiscard]] RecordedTimeline ReadTimeline(const std::filesystem::path& recording, const std::stop_token& stop = {});

}  // namespace fulcrum::assessment
