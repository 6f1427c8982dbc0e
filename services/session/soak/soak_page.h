// soak.html and samples.csv of a soak.
#pragma once

#include <string>

#include "services/session/soak/soak_record.h"

namespace fulcrum::soak {

/// Page with figures, plots and all blows. `title`: scene and time; `session`: folder of the session, for links.
[[nodiscard]] std::string SoakPage(const SoakRecord& record, const Limits& limits, const std::string& title,
                                   const std::string& session);

/// CSV text with one line per sample: time_s, program, process, figure, value.
[[nodiscard]] std::string SamplesCsv(const SoakRecord& record);

}  // namespace fulcrum::soak
