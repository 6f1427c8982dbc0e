// A link's figures in the Health of the supervisor that holds it.
#pragma once

#include "services/transport/link/link.h"

namespace fulcrum::link {

/// Metrics "link_…", and last_error where there is none yet.
void FillHealth(const LinkStatus& status, Health* health);

}  // namespace fulcrum::link
