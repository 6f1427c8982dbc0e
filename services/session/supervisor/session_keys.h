// The keys of a session: those that the cart file names are checked before any node is started, because a node would
// report the problem in its log only; without them each session makes its own.
#pragma once

#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"

namespace fulcrum::supervisor {

/// Throws InputError when the keys do not let the supervisor or one of the nodes join. @return one line on keys that
/// expire soon; empty: none do, or the cart is not secured.
[[nodiscard]] std::string CheckSessionKeys(const config::CartConfig& cart, std::vector<NodeId> nodes, std::time_t now);

/// Makes keys for one session in the cart's private directory, with the authority's key beside them, so that `fulcrum
/// keys issue` can admit further participants while the session runs. Replaces those of an earlier session. @return the
/// folder. Throws InputError.
[[nodiscard]] std::filesystem::path MakeKeysOfSession(const std::filesystem::path& memory);

}  // namespace fulcrum::supervisor
