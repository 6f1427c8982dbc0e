// A link's figures in Health.
#pragma once

#include "services/link/link.h"

namespace fulcrum::link {

/// Metrics and last_error; degraded when the other side is not connected.
void FillHealth(const LinkStatus& status, Health* health);

}  // namespace fulcrum::link
