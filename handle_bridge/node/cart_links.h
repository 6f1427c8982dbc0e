// From a cart's description to open links, and from a scene's script to the simulated operator.
#pragma once

#include <array>

#include "handle_bridge/node/handle_bridge_node.h"
#include "handle_bridge/serial/simulated_firmware.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::handle_bridge {

/// True when something on the cart is simulated.
[[nodiscard]] bool HasSimulatedLinks(const config::CartConfig& cart);

/// `firmware` serves the simulated links and must outlive them; null when there are none.
[[nodiscard]] HandleBridgeNode::Links MakeCartLinks(const config::CartConfig& cart, SimulatedFirmware* firmware);

/// The simulated handles and pedal as the cart describes them.
[[nodiscard]] std::array<SimulatedUnit, kLinks> MakeSimulatedUnits(const config::CartConfig& cart);

/// What the cart lets befall a simulated link at a session time.
[[nodiscard]] LinkFaults FaultsAt(const config::SimulatedUnit& unit, double session_time_s);

/// Jaws and pedals of the scripted operator and the faults of the cart's links; a pedal is down when any tool's key
/// says so. Before the session is known (negative time) the jaws are at their first key and the pedals up.
[[nodiscard]] OperatorInput FollowScript(const SceneView& scene, const config::CartConfig& cart, double session_time_s);

}  // namespace fulcrum::handle_bridge
