#include "services/transport/link/options.h"

#include <ctime>
#include <sstream>

#include "services/base/core/error.h"
#include "services/transport/keys/key_folder.h"

namespace fulcrum::link {
namespace {

/// Nodes that can run on another host. Processes of the session itself stay on the cart's host.
constexpr NodeId kMovable[] = {NodeId::kHandleBridge, NodeId::kHaptics, NodeId::kPhysics, NodeId::kThermal,
                               NodeId::kRender};
constexpr int kBetweenDomains = 100;

}  // namespace

std::uint32_t NodesFromNames(const std::string& names) {
  std::uint32_t nodes = 0;
  std::istringstream stream(names);
  for (std::string name; std::getline(stream, name, ',');) {
    std::uint32_t bit = 0;
    for (const NodeId node : kMovable) {
      if (name == NodeName(node)) bit = 1u << static_cast<unsigned>(node);
    }
    if (bit == 0) {
      throw InputError("no node \"" + name +
                       "\" that can run on another host; valid, with commas between: " + NamesOfNodes(~0u));
    }
    nodes |= bit;
  }
  if (nodes == 0)
    throw InputError("which nodes run on the other host? valid, with commas between: " + NamesOfNodes(~0u));
  return nodes;
}

std::string NamesOfNodes(std::uint32_t nodes) {
  std::string names;
  for (const NodeId node : kMovable) {
    if ((nodes >> static_cast<unsigned>(node) & 1u) == 0) continue;
    names += (names.empty() ? "" : ",") + std::string(NodeName(node));
  }
  return names;
}

int LinkDomain(int given, std::optional<int> cart_domain) {
  if (given != 0) return given;
  return cart_domain ? *cart_domain + kBetweenDomains : kUsualLinkDomain;
}

bus::FarSettings FarSettingsFor(bus::FarSide side, const std::string& peer, const std::string& address,
                                int link_domain) {
  bus::FarSettings far;
  far.side = side;
  far.peer = bus::ResolveAddress(peer);
  far.follows_route = address.empty();
  far.address = address.empty() ? bus::AddressTowards(far.peer) : bus::ResolveAddress(address);
  far.domain = link_domain;
  if (far.domain < bus::kFirstLinkDomain || far.domain > bus::kLastLinkDomain) {
    throw InputError("link domain " + std::to_string(far.domain) + ": must be 101 to 200, the same on both hosts");
  }
  return far;
}

std::filesystem::path KeysOfLink(const std::filesystem::path& given, const std::filesystem::path& of_cart,
                                 bool insecure) {
  if (insecure && !given.empty()) throw InputError("--insecure-link is a link without keys: give it or --keys");
  if (insecure) return {};
  const std::filesystem::path standard = keys::DefaultKeyFolder();
  const std::filesystem::path folder = !given.empty() ? given : !of_cart.empty() ? of_cart : standard;
  if (folder == standard && !std::filesystem::exists(folder)) {
    throw InputError(
        "two machines of a cart need keys, and " + folder.string() +
        " does not exist: run `fulcrum keys init` on one machine, copy that folder to the same place on the other, and "
        "start again (--keys DIR names another folder; --insecure-link works without keys, for a closed bench)");
  }
  (void)keys::CheckIdentity(folder, bus::kLinkIdentity, true, std::time(nullptr));
  return std::filesystem::absolute(folder);
}

}  // namespace fulcrum::link
