#include "services/session/supervisor/offered_cart.h"

#include <functional>

#include "services/base/core/error.h"

namespace fulcrum::supervisor {
namespace {

/// A key that names a file or a device of one machine.
struct LocalKey {
  std::string key;    ///< As in a cart file.
  std::string value;  ///< For messages.
  NodeId node;        ///< The node that opens it.
  std::function<void()> reset;
};

void AddLine(const std::string& key, config::LinkKind* kind, config::SerialLink* link, std::vector<LocalKey>* keys) {
  if (*kind != config::LinkKind::kSerial && link->port.empty()) return;
  keys->push_back(
      {key, link->port.empty() ? "kind: serial" : "port: " + link->port, NodeId::kHandleBridge, [kind, link] {
         if (*kind == config::LinkKind::kSerial) *kind = config::LinkKind::kNone;
         *link = {};
       }});
}

std::vector<LocalKey> LocalKeysOf(config::CartConfig* cart) {
  std::vector<LocalKey> keys;
  for (std::size_t tool = 0; tool < cart->handles.size(); ++tool) {
    AddLine("handles.tool" + std::to_string(tool), &cart->handles[tool].kind, &cart->handles[tool].link, &keys);
  }
  AddLine("pedal", &cart->pedal.kind, &cart->pedal.link, &keys);
  for (std::size_t tool = 0; tool < cart->devices.size(); ++tool) {
    config::DeviceConfig* device = &cart->devices[tool];
    const std::string key = "devices.tool" + std::to_string(tool);
    if (device->kind == config::DeviceKind::kTouch) {
      keys.push_back({key, "kind: touch", NodeId::kHaptics, [device] { device->kind = config::DeviceKind::kNone; }});
    }
    if (!device->motion.empty()) {
      keys.push_back({key + ".motion", device->motion, NodeId::kHaptics, [device] { device->motion.clear(); }});
    }
  }
  return keys;
}

/// Replaces the lines and devices that nodes of this host open by its own. An operator's input stays: it belongs to the
/// session, whatever hardware a machine has.
void UseOwnHardware(const config::CartConfig& own, std::uint32_t nodes, config::CartConfig* cart) {
  const auto runs = [nodes](NodeId node) { return (nodes >> static_cast<unsigned>(node) & 1u) != 0; };
  if (runs(NodeId::kHandleBridge)) {
    for (std::size_t tool = 0; tool < cart->handles.size(); ++tool) {
      if (cart->handles[tool].kind != config::LinkKind::kOperator) cart->handles[tool] = own.handles[tool];
    }
    if (cart->pedal.kind != config::LinkKind::kOperator) cart->pedal = own.pedal;
  }
  if (!runs(NodeId::kHaptics)) return;
  for (std::size_t tool = 0; tool < cart->devices.size(); ++tool) {
    if (cart->devices[tool].kind != config::DeviceKind::kOperator) cart->devices[tool] = own.devices[tool];
  }
}

constexpr const char* kWhatToDo =
    "; start fulcrum host with --cart FILE, whose handles, pedal and devices are those of the host";

}  // namespace

OfferedCart CartForHost(config::CartConfig cart, std::uint32_t nodes) {
  OfferedCart offered{std::move(cart), {}};
  for (const LocalKey& local : LocalKeysOf(&offered.cart)) {
    local.reset();
    if ((nodes >> static_cast<unsigned>(local.node) & 1u) == 0) continue;
    offered.withheld += (offered.withheld.empty() ? "" : ", ") + local.key;
  }
  offered.cart.security = {};  // Each host has its own folder of keys.
  return offered;
}

config::CartConfig CartOnHost(const link::Offer& offer, const std::string& from,
                              const std::optional<config::CartConfig>& own) {
  const std::string name = "the cart of " + from;
  config::CartConfig cart = config::LoadCartText(offer.cart_yaml, name);
  if (!cart.security.keys.empty()) {
    throw InputError(name + ": security.keys: \"" + cart.security.keys +
                     "\" is a path; a cart may name no file of another host");
  }
  cart.security.encrypt = own && own->security.encrypt;
  if (own) {
    for (const LocalKey& local : LocalKeysOf(&cart)) local.reset();
    UseOwnHardware(*own, offer.nodes, &cart);
    return cart;
  }
  if (const std::vector<LocalKey> local = LocalKeysOf(&cart); !local.empty()) {
    throw InputError(name + ": " + local.front().key + ": \"" + local.front().value +
                     "\" names a file or device; a cart may name none of another host" + kWhatToDo);
  }
  if (!offer.withheld.empty()) {
    throw InputError(name + ": " + offer.withheld + " name a file or device of the cart's own machine" + kWhatToDo);
  }
  return cart;
}

}  // namespace fulcrum::supervisor
