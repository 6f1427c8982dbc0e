#include "handle_bridge/node/cart_links.h"

#include <algorithm>
#include <memory>
#include <numbers>

#include "handle_bridge/serial/serial_port.h"
#include "services/core/operator_script.h"

namespace fulcrum::handle_bridge {
namespace {

std::unique_ptr<ByteLink> MakeLink(config::LinkKind kind, const config::SerialLink& link, SimulatedFirmware* firmware,
                                   int firmware_link) {
  switch (kind) {
    case config::LinkKind::kNone:
      return nullptr;
    case config::LinkKind::kSimulated:
      return std::make_unique<ReconnectingLink>(firmware->MakeOpener(firmware_link, link.baud));
    case config::LinkKind::kSerial:
      return std::make_unique<ReconnectingLink>(std::make_unique<SerialPortOpener>(link));
  }
  return nullptr;
}

}  // namespace

bool HasSimulatedLinks(const config::CartConfig& cart) {
  return cart.pedal.kind == config::LinkKind::kSimulated ||
         std::any_of(cart.handles.begin(), cart.handles.end(),
                     [](const config::HandleConfig& handle) { return handle.kind == config::LinkKind::kSimulated; });
}

HandleBridgeNode::Links MakeCartLinks(const config::CartConfig& cart, SimulatedFirmware* firmware) {
  HandleBridgeNode::Links links;
  for (std::size_t tool = 0; tool < links.handles.size(); ++tool) {
    links.handles[tool] = MakeLink(cart.handles[tool].kind, cart.handles[tool].link, firmware, static_cast<int>(tool));
  }
  links.pedal = MakeLink(cart.pedal.kind, cart.pedal.link, firmware, SimulatedFirmware::kPedalLink);
  return links;
}

OperatorInput FollowScript(const SceneView& scene, double session_time_s) {
  constexpr double kDegPerRad = 180.0 / std::numbers::pi;
  OperatorInput input;
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    const ScriptPoint point = EvaluateScript(scene.script, tool, session_time_s);
    input.jaw_deg[tool] = kDegPerRad * point.jaw_rad;
    input.pedals = static_cast<std::uint8_t>(input.pedals | point.pedals);
  }
  return input;
}

}  // namespace fulcrum::handle_bridge
