// A trainee's sessions in the order of their start: a table and plots.
#pragma once

#include <string>
#include <vector>

#include "services/session/supervisor/training_log.h"

namespace fulcrum::supervisor {

[[nodiscard]] std::string TraineeTable(const std::vector<TrainingRow>& rows);

/// One SVG file: score and the most informative measures over the number of the session. Empty without sessions.
[[nodiscard]] std::string TraineeSvg(const std::string& trainee, const std::vector<TrainingRow>& rows);

}  // namespace fulcrum::supervisor
