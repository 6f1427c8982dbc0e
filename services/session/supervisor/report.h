// report.html of a session: one file with everything in it.
#pragma once

#include <filesystem>
#include <string>

#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor {

/// CSS that all generated pages share.
[[nodiscard]] const char* PageStyle();

/// The text of report.html. Takes long, because it reads and encodes PNG files.
/// @param frames folder of the pictures.
/// @param clip MP4 of the pictures; may be missing.
[[nodiscard]] std::string ReportHtml(const SessionOutcome& outcome, const SessionRecord& record,
                                     const std::filesystem::path& frames, const std::filesystem::path& clip);

}  // namespace fulcrum::supervisor
