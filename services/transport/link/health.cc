#include "services/transport/link/health.h"

namespace fulcrum::link {

void FillHealth(const LinkStatus& status, Health* health) {
  health->metrics.insert(health->metrics.end(), {{"link_connected", status.connected ? 1.0 : 0.0},
                                                 {"link_clock_offset_us", status.offset_us},
                                                 {"link_clock_drift_ppm", status.drift_ppm},
                                                 {"link_round_trip_us", status.round_trip_us},
                                                 {"link_tissue_kB_per_s", status.tissue_kB_per_s},
                                                 {"link_kB_per_s", status.sent_kB_per_s + status.received_kB_per_s},
                                                 {"link_lost", static_cast<double>(status.lost)},
                                                 {"link_refused", static_cast<double>(status.refused)}});
  if (status.insecure) health->metrics.push_back({"insecure_link", 1.0});
  if (health->last_error.empty()) health->last_error = status.error;
}

}  // namespace fulcrum::link
