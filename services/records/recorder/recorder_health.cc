#include "services/records/recorder/recorder_health.h"

#include <string>

namespace fulcrum::recorder {

void FillHealth(const RecorderStats& stats, Health* health) {
  health->metrics = {{"recorded_samples", static_cast<double>(stats.received - stats.unwritten)},
                     {"recorded_MB", 1e-6 * static_cast<double>(stats.file_B)},
                     {"lost_samples", static_cast<double>(stats.lost())},
                     {"lost_for_replay", static_cast<double>(stats.needed_lost)},
                     {"queue_pct", stats.queue_pct}};
  if (stats.error.empty()) return;
  health->state = HealthState::kDegraded;
  health->last_error = stats.error + ": " + std::to_string(stats.unwritten) + " samples are not in the file";
}

}  // namespace fulcrum::recorder
