// The cart of a session as another host may use it: neither machine opens a file or a device because the other one
// names it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "services/base/config/cart.h"
#include "services/transport/link/codec/packet.h"

namespace fulcrum::supervisor {

struct OfferedCart {
  config::CartConfig cart;
  /// Keys of `cart` that were reset because they name a file or a device of this machine, and that concern a node of
  /// the other host, with commas between.
  std::string withheld;
};
/// @param nodes bit per NodeId: nodes of the other host.
[[nodiscard]] OfferedCart CartForHost(config::CartConfig cart, std::uint32_t nodes);

/// The cart with which a host runs the nodes of an offer.
/// @param from the other host, for messages. @param own the host's own cart file: its handles, pedal and devices
/// replace those of the offer for the nodes that run here, except where an operator's input moves them, and its
/// `security.encrypt` counts. Without it an offer that names a file or a device, or withholds one, is refused. Throws
/// InputError naming the key.
[[nodiscard]] config::CartConfig CartOnHost(const link::Offer& offer, const std::string& from,
                                            const std::optional<config::CartConfig>& own);

}  // namespace fulcrum::supervisor
