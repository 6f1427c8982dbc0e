// Figures of a link in the Health of the supervisor that holds it.
#pragma once

#include "services/transport/link/link.h"

namespace fulcrum::link {

/// Adds the metrics "link_…", and sets last_error if it is still empty.
void FillHealth(const LinkStatus& status, Health* health);

}  // namespace fulcrum::link
