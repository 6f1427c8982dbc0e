// soak.html and samples.csv of a soak.
#pragma once

#include <string>

#include "services/session/soak/soak_record.h"

namespace fulcrum::soak {

/// One page with figures, plots and all blows. `title`: scene and time; `session`: what the page links to.
[[nodiscard]] std::string SoakPage(const SoakRecord& record, const Limits& limits, const std::string& title,
                                   const std::string& session);

/// A line a sample: time_s, program, process, figure, value.
[[nodiscard]] std::string SamplesCsv(const SoakRecord& record);

}  // namespace fulcrum::soak
