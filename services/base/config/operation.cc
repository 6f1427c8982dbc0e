#include "services/base/config/operation.h"

#include <algorithm>

namespace fulcrum::config {

bool MovedByPerson(const CartConfig& cart, const std::array<ToolDescription, kMaxTools>& tools) {
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const DeviceKind kind = cart.devices[i].kind;
    if (tools[i].kind == ToolKind::kNone) continue;
    if (kind == DeviceKind::kTouch || kind == DeviceKind::kOperator) return true;
  }
  return false;
}

bool HasTouch(const CartConfig& cart) {
  return std::ranges::any_of(cart.devices, [](const DeviceConfig& d) { return d.kind == DeviceKind::kTouch; });
}

void LetScriptMove(CartConfig* cart) {
  const CartConfig simulated;
  cart->devices = simulated.devices;
  cart->handles = simulated.handles;
  cart->pedal = simulated.pedal;
}

}  // namespace fulcrum::config
