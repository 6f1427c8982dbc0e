// The keys of a secured session, looked at before anybody is started: a node's own refusal would stand in its log only.
#pragma once

#include <ctime>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"

namespace fulcrum::supervisor {

/// Throws InputError when the supervisor or one of the nodes could not join. @return what to tell of keys that are
/// about to expire; empty: nothing, or no security.
[[nodiscard]] std::string CheckSessionKeys(const config::CartConfig& cart, std::vector<NodeId> nodes, std::time_t now);

}  // namespace fulcrum::supervisor
