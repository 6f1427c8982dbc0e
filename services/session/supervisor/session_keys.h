// Check of the keys of a secured session before any node is started: a node would report the problem in its log only.
#pragma once

#include <ctime>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"

namespace fulcrum::supervisor {

/// Throws InputError when the keys do not let the supervisor or one of the nodes join. @return one line on keys that
/// expire soon; empty: none do, or the cart is not secured.
[[nodiscard]] std::string CheckSessionKeys(const config::CartConfig& cart, std::vector<NodeId> nodes, std::time_t now);

}  // namespace fulcrum::supervisor
