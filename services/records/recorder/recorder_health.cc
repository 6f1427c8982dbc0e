#include "services/records/recorder/recorder_health.h"

#include <string>

namespace fulcrum::recorder {
namespace {

/// Time in which an operator can free space [s].
constexpr double kFewSeconds = 60;

}  // namespace

void FillHealth(const RecorderStats& stats, Health* health) {
  health->metrics = {{"recorded_samples", static_cast<double>(stats.received - stats.unwritten)},
                     {"recorded_MB", 1e-6 * static_cast<double>(stats.file_B)},
                     {"lost_samples", static_cast<double>(stats.lost())},
                     {"lost_for_replay", static_cast<double>(stats.needed_lost)},
                     {"queue_pct", stats.queue_pct}};
  health->metrics.push_back({"recording_ended", stats.ended.empty() ? 0.0 : 1.0});
  health->metrics.push_back({"not_recorded", static_cast<double>(stats.not_recorded)});
  if (!stats.ended.empty()) {
    health->state = HealthState::kDegraded;
    health->last_error = stats.ended;
  } else if (stats.left_s >= 0) {
    health->metrics.push_back({"room_left_s", stats.left_s});
    if (stats.left_s < kFewSeconds) {
      health->last_error = "there is room for " + std::to_string(static_cast<int>(stats.left_s)) +
                           " s more of recording; delete old sessions";
    }
  }
}

}  // namespace fulcrum::recorder
