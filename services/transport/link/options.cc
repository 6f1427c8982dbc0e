#include "services/transport/link/options.h"

#include <sstream>

#include "services/base/core/error.h"
#include "services/transport/bus/access.h"

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

bus::FarSettings FarSettingsFor(bus::FarSide side, const std::string& peer, const std::string& address, int cart_domain,
                                int link_domain) {
  bus::FarSettings far;
  far.side = side;
  far.peer = bus::ResolveAddress(peer);
  far.address = address.empty() ? bus::AddressTowards(far.peer) : bus::ResolveAddress(address);
  far.domain = link_domain != 0 ? link_domain : cart_domain + kBetweenDomains;
  if (far.domain < bus::kFirstLinkDomain || far.domain > bus::kLastLinkDomain) {
    throw InputError("link domain " + std::to_string(far.domain) + ": must be 101 to 200, the same on both hosts");
  }
  return far;
}

}  // namespace fulcrum::link
