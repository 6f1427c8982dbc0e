#include "services/session/supervisor/restart_policy.h"

#include <algorithm>

namespace fulcrum::supervisor {

std::optional<std::int64_t> RestartPolicy::OnDeath(std::int64_t lived_ns) {
  quick_deaths_ = lived_ns >= settings_.healthy_ns ? 1 : quick_deaths_ + 1;
  if (quick_deaths_ >= settings_.most_quick_deaths) {
    return std::nullopt;
  }
  if (quick_deaths_ == 1) {
    return 0;
  }
  const std::int64_t delay = settings_.first_delay_ns << (quick_deaths_ - 2);
  return std::min(delay, settings_.longest_delay_ns);
}

}  // namespace fulcrum::supervisor
