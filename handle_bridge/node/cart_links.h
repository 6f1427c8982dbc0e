// Opens the links that a cart describes, and derives the simulated operator's input from a scene's script.
#pragma once

#include <array>

#include "handle_bridge/node/handle_bridge_node.h"
#include "handle_bridge/serial/simulated_firmware.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::handle_bridge {

/// The cart without simulated handles of tools that the scene does not have.
[[nodiscard]] config::CartConfig ForScene(config::CartConfig cart, const SceneView& scene);

/// True if any handle or the pedal of the cart is of this kind.
[[nodiscard]] bool HasLinks(const config::CartConfig& cart, config::LinkKind kind);

/// Opens all links. `firmware` serves the simulated links, and those that an operator's input moves, and must outlive
/// them; null if there are none.
[[nodiscard]] HandleBridgeNode::Links MakeCartLinks(const config::CartConfig& cart, SimulatedFirmware* firmware);

/// Properties of the simulated handles and pedal in the cart.
[[nodiscard]] std::array<SimulatedUnit, kLinks> MakeSimulatedUnits(const config::CartConfig& cart);

/// Faults of a simulated link that the cart schedules for a session time.
[[nodiscard]] LinkFaults FaultsAt(const config::SimulatedUnit& unit, double session_time_s);

/// Jaws and pedals of the scripted operator and the faults of the cart's links; a pedal is pressed if it is in any
/// tool's key. Before the session has started (negative time) the jaws have the angles of their first key and all
/// pedals are released.
class ScriptedHands {
 public:
  /// `scene` and `cart` must outlive this.
  ScriptedHands(const SceneView& scene, const config::CartConfig& cart);
  [[nodiscard]] SimulatedInput At(double session_time_s) const;

 private:
  const SceneView& scene_;
  const config::CartConfig& cart_;
  /// Session time at which a tool's script stands still [s]: LastHoldOf of an assistant beside a person, else infinite.
  std::array<double, kMaxTools> stays_s_{};
};

/// Session time until which the scripted hands stay as they are [s]: infinite after the last change, `session_time_s`
/// while something changes or where the cart schedules faults.
[[nodiscard]] double ScriptRestsUntil(const SceneView& scene, const config::CartConfig& cart, double session_time_s);

/// Only the script moves jaws and pedals: a real line can bring a change at any time, and so can an operator.
[[nodiscard]] bool IsScripted(const config::CartConfig& cart);

/// Time for which the scripted hands stay as they are, at most a second [ns]; 0 before the session, and
/// unless all is scripted.
[[nodiscard]] std::int64_t ScriptRest_ns(const SceneView& scene, const config::CartConfig& cart, double session_time_s);

/// Handles and pedal of kind `operator`: simulated firmware whose jaws and pedals are an operator's instead of the
/// script's.
class OperatedHands {
 public:
  OperatedHands(const config::CartConfig& cart, const SceneView& scene);

  /// @param operated newest input of the present operator; null: there is none. Jaws then keep their angles and the
  /// pedal is released.
  [[nodiscard]] SimulatedInput Replace(SimulatedInput input, const OperatorInput* operated);

 private:
  static constexpr double kStartJaw_deg = 30;

  const config::CartConfig& cart_;
  std::array<bool, kMaxTools> assists_{};  ///< No person operates it.
  std::array<double, kMaxTools> jaw_deg_;
};

}  // namespace fulcrum::handle_bridge
