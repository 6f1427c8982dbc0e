// How a user names the other host and its nodes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/bus/dds/far_participant.h"

namespace fulcrum::link {

/// "render_node,thermal_node" as a bit per NodeId. Throws InputError for what is no node that can run on another host.
[[nodiscard]] std::uint32_t NodesFromNames(const std::string& names);
/// "thermal_node,render_node".
[[nodiscard]] std::string NamesOfNodes(std::uint32_t nodes);

/// @param peer address or name of the other host. @param address ours; empty: of the interface that leads there.
/// @param link_domain 101 … 200; 0: 100 more than the cart's. Throws InputError.
[[nodiscard]] bus::FarSettings FarSettingsFor(bus::FarSide side, const std::string& peer, const std::string& address,
                                              int cart_domain, int link_domain);

}  // namespace fulcrum::link
