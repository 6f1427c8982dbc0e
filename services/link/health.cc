#include "services/link/health.h"

namespace fulcrum::link {

void FillHealth(const LinkStatus& status, Health* health) {
  health->metrics.insert(health->metrics.end(), {{"connected", status.connected ? 1.0 : 0.0},
                                                 {"clock_offset_us", status.offset_us},
                                                 {"round_trip_us", status.round_trip_us},
                                                 {"clock_drift_ppm", status.drift_ppm},
                                                 {"sent_kB_per_s", status.sent_kB_per_s},
                                                 {"received_kB_per_s", status.received_kB_per_s},
                                                 {"tissue_kB_per_s", status.tissue_kB_per_s},
                                                 {"lost_packets", static_cast<double>(status.lost)},
                                                 {"refused_packets", static_cast<double>(status.refused)},
                                                 {"reconnections", static_cast<double>(status.rebuilt)},
                                                 {"silence_s", status.silence_s}});
  health->last_error = status.error;
  if (health->state == HealthState::kRunning && !status.connected) health->state = HealthState::kDegraded;
}

}  // namespace fulcrum::link
