// Opens the links that a cart describes, and derives the simulated operator's input from a scene's script.
#pragma once

#include <array>

#include "handle_bridge/node/handle_bridge_node.h"
#include "handle_bridge/serial/simulated_firmware.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::handle_bridge {

/// True if any handle or pedal of the cart is simulated.
[[nodiscard]] bool HasSimulatedLinks(const config::CartConfig& cart);

/// Opens all links. `firmware` serves the simulated links and must outlive them; null if there are none.
[[nodiscard]] HandleBridgeNode::Links MakeCartLinks(const config::CartConfig& cart, SimulatedFirmware* firmware);

/// Properties of the simulated handles and pedal in the cart.
[[nodiscard]] std::array<SimulatedUnit, kLinks> MakeSimulatedUnits(const config::CartConfig& cart);

/// Faults of a simulated link that the cart schedules for a session time.
[[nodiscard]] LinkFaults FaultsAt(const config::SimulatedUnit& unit, double session_time_s);

/// Jaws and pedals of the scripted operator and the faults of the cart's links; a pedal is pressed if it is in any
/// tool's key. Before the session has started (negative time) the jaws have the angles of their first key and all
/// pedals are released.
[[nodiscard]] OperatorInput FollowScript(const SceneView& scene, const config::CartConfig& cart, double session_time_s);

}  // namespace fulcrum::handle_bridge
