// The result of a what-if replay as text and as JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/apps/replayer/what_if.h"

namespace fulcrum::replay {

/// Text with one line per quantity of the replayed nodes.
[[nodiscard]] std::string ReportText(const WhatIfResult& result, const std::vector<NodeId>& nodes);

/// One flat object with the names of WhatIfResult, pairs as `<name>.before` and `<name>.after`. Throws InputError when
/// the file cannot be written.
void WriteReportJson(const WhatIfResult& result, const std::filesystem::path& file);

}  // namespace fulcrum::replay
