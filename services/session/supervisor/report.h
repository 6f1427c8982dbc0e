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
[[nodiscard]] std::string ReportHtml(const SessionOutcome& outcome, const SessionRecord& record,
                                     const std::filesystem::path& frames);

}  // namespace fulcrum::supervisor
