// report.html of a session: one file with everything in it.
#pragma once

#include <filesystem>
#include <string>

#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor {

/// CSS of our pages.
[[nodiscard]] const char* PageStyle();

/// `frames`: folder of the pictures; `clip`: an MP4 of them, if it exists. Long: reads and encodes PNG files.
[[nodiscard]] std::string ReportHtml(const SessionOutcome& outcome, const SessionRecord& record,
                                     const std::filesystem::path& frames, const std::filesystem::path& clip);

}  // namespace fulcrum::supervisor
