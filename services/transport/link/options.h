// Options by which a user names the other host and its nodes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/far_participant.h"

namespace fulcrum::link {

/// Parses "render_node,thermal_node" into a bit per NodeId. Throws InputError for a name that is no node which can run
/// on another host.
[[nodiscard]] std::uint32_t NodesFromNames(const std::string& names);
/// Inverse of NodesFromNames: "thermal_node,render_node".
[[nodiscard]] std::string NamesOfNodes(std::uint32_t nodes);

/// Domain of a link where neither option nor cart file gives one: the same for every user, because the two ends often
/// run as different users, and the domain of a cart that names none depends on the user.
inline constexpr int kUsualLinkDomain = bus::kFirstLinkDomain;
/// Domain of the link. @param given value of --link-domain; 0: not given. @param cart_domain domain that an option or
/// the cart file gives; the link's is 100 more. Without both: kUsualLinkDomain.
[[nodiscard]] int LinkDomain(int given, std::optional<int> cart_domain);

/// @param peer address or name of the other host. @param address address of this host; empty: that of the interface
/// with the route to `peer`.
/// @param link_domain 101 to 200. Throws InputError.
[[nodiscard]] bus::FarSettings FarSettingsFor(bus::FarSide side, const std::string& peer, const std::string& address,
                                              int link_domain);

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
