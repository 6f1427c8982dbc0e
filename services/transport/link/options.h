// Options by which a user names the other host and its nodes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/bus/dds/far_participant.h"

namespace fulcrum::link {

/// Parses "render_node,thermal_node" into a bit per NodeId. Throws InputError for a name that is no node which can run
/// on another host.
[[nodiscard]] std::uint32_t NodesFromNames(const std::string& names);
/// Inverse of NodesFromNames: "thermal_node,render_node".
[[nodiscard]] std::string NamesOfNodes(std::uint32_t nodes);

/// @param peer address or name of the other host. @param address address of this host; empty: that of the interface
/// with the route to `peer`.
/// @param link_domain 101 to 200; 0: 100 more than the cart's domain. Throws InputError.
[[nodiscard]] bus::FarSettings FarSettingsFor(bus::FarSide side, const std::string& peer, const std::string& address,
                                              int cart_domain, int link_domain);

/// Folder of the keys of a link: `given` with --keys, else that of the cart file, else the default folder of
/// `fulcrum keys init` if it exists; empty for an insecure link. Throws InputError, with what to do, when there is none
/// or the link cannot use it.
[[nodiscard]] std::filesystem::path KeysOfLink(const std::filesystem::path& given, const std::filesystem::path& of_cart,
                                               bool insecure);

/// One line about a link without keys.
inline constexpr const char* kInsecureLink =
    "insecure link: it has no keys (--insecure-link), so every machine on this network can join the session, and its "
    "data can be read";

}  // namespace fulcrum::link
