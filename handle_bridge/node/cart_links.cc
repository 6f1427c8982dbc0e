#include "handle_bridge/node/cart_links.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "handle_bridge/serial/serial_port.h"
#include "services/base/config/operation.h"
#include "services/base/core/operator_script.h"
#include "services/base/core/script_rest.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

std::unique_ptr<WatchedLink> MakeLink(config::LinkKind kind, const config::SerialLink& link,
                                      SimulatedFirmware* firmware, std::size_t firmware_link) {
  std::unique_ptr<ByteSourceOpener> opener;
  switch (kind) {
    case config::LinkKind::kNone:
    case config::LinkKind::kButtons:
      return nullptr;
    case config::LinkKind::kSimulated:
    case config::LinkKind::kOperator:
      opener = firmware->MakeOpener(firmware_link);
      break;
    case config::LinkKind::kSerial:
      opener = std::make_unique<SerialPortOpener>(link);
      break;
  }
  return std::make_unique<WatchedLink>(std::make_unique<ReconnectingLink>(std::move(opener), link.baud), link.baud);
}

bool Within(const std::vector<double>& ends_s, double time_s) {
  // Within an interval an odd number of interval ends has passed.
  return (std::upper_bound(ends_s.begin(), ends_s.end(), time_s) - ends_s.begin()) % 2 != 0;
}

}  // namespace

config::CartConfig ForScene(config::CartConfig cart, const SceneView& scene) {
  for (std::size_t tool = 0; tool < cart.handles.size(); ++tool) {
    const config::LinkKind kind = cart.handles[tool].kind;
    const bool real = kind == config::LinkKind::kSerial || kind == config::LinkKind::kButtons;
    if (scene.tools[tool].kind == ToolKind::kNone && !real) cart.handles[tool].kind = config::LinkKind::kNone;
  }
  return cart;
}

bool HasLinks(const config::CartConfig& cart, config::LinkKind kind) {
  return cart.pedal.kind == kind ||
         std::any_of(cart.handles.begin(), cart.handles.end(),
                     [=](const config::HandleConfig& handle) { return handle.kind == kind; });
}

HandleBridgeNode::Links MakeCartLinks(const config::CartConfig& cart, SimulatedFirmware* firmware) {
  HandleBridgeNode::Links links;
  for (std::size_t tool = 0; tool < links.handles.size(); ++tool) {
    links.handles[tool] = MakeLink(cart.handles[tool].kind, cart.handles[tool].link, firmware, tool);
  }
  links.pedal = MakeLink(cart.pedal.kind, cart.pedal.link, firmware, kPedalLink);
  return links;
}

std::array<SimulatedUnit, kLinks> MakeSimulatedUnits(const config::CartConfig& cart) {
  std::array<SimulatedUnit, kLinks> units = SimulatedFirmware::DefaultUnits();
  for (std::size_t tool = 0; tool < cart.handles.size(); ++tool) {
    const config::HandleConfig& handle = cart.handles[tool];
    units[tool].framed = handle.simulated.protocol == config::LineProtocol::kFramed;
    units[tool].sender = SenderOf(handle.hand);
    JawFirmwareSettings& jaw = units[tool].jaw;
    jaw.closed_V = handle.simulated.closed_V;
    jaw.open_V = handle.simulated.open_V;
    jaw.bow = handle.simulated.bow;
    jaw.adc_step_V = handle.calibration.adc_step_V;
    jaw.noise_V = handle.simulated.noise_V;
    jaw.tremor_deg = kDegPerRad * handle.simulated.tremor_rad;
  }
  units[kPedalLink].framed = cart.pedal.simulated.protocol == config::LineProtocol::kFramed;
  return units;
}

LinkFaults FaultsAt(const config::SimulatedUnit& unit, double session_time_s) {
  LinkFaults faults;
  faults.cable = {unit.drop, unit.flip, Within(unit.garbage_s, session_time_s)};
  faults.silent = Within(unit.silent_s, session_time_s);
  faults.wrong_baud = Within(unit.wrong_baud_s, session_time_s);
  faults.broken_wire = Within(unit.broken_wire_s, session_time_s);
  faults.unplugged = Within(unit.unplugged_s, session_time_s);
  return faults;
}

ScriptedHands::ScriptedHands(const SceneView& scene, const config::CartConfig& cart) : scene_(scene), cart_(cart) {
  const bool by_person = config::MovedByPerson(cart, scene.tools);
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    const bool stays = scene.tools[tool].assists() && by_person;
    // Once: a script that a hand performs has 180,000 keys of a tool in an hour, and the firmware asks at 400 Hz.
    stays_s_[tool] = stays ? LastHoldOf(scene.script, tool) : std::numeric_limits<double>::infinity();
  }
}

SimulatedInput ScriptedHands::At(double session_time_s) const {
  SimulatedInput input;
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    const ScriptPoint point = EvaluateScript(scene_.script, tool, std::min(session_time_s, stays_s_[tool]));
    input.jaw_deg[tool] = kDegPerRad * point.jaw_rad;
    input.pedals = static_cast<std::uint8_t>(input.pedals | point.pedals);
    input.faults[tool] = FaultsAt(cart_.handles[tool].simulated, session_time_s);
  }
  input.faults[kPedalLink] = FaultsAt(cart_.pedal.simulated, session_time_s);
  return input;
}

double ScriptRestsUntil(const SceneView& scene, const config::CartConfig& cart, double session_time_s) {
  const auto has_faults = [](const config::SimulatedUnit& unit) {
    return !unit.garbage_s.empty() || !unit.silent_s.empty() || !unit.wrong_baud_s.empty() ||
           !unit.broken_wire_s.empty() || !unit.unplugged_s.empty();
  };
  double until_s = std::numeric_limits<double>::infinity();
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    if (has_faults(cart.handles[tool].simulated)) return session_time_s;
    until_s = std::min(until_s, fulcrum::ScriptRestsUntil(scene.script, tool, session_time_s));
  }
  return has_faults(cart.pedal.simulated) ? session_time_s : std::max(until_s, session_time_s);
}

bool IsScripted(const config::CartConfig& cart) {
  const auto scripted = [](config::LinkKind kind) {
    return kind == config::LinkKind::kNone || kind == config::LinkKind::kSimulated;
  };
  return scripted(cart.pedal.kind) &&
         std::ranges::all_of(cart.handles, [&](const config::HandleConfig& handle) { return scripted(handle.kind); });
}

std::int64_t ScriptRest_ns(const SceneView& scene, const config::CartConfig& cart, double session_time_s) {
  if (session_time_s < 0 || !IsScripted(cart)) return 0;
  return std::llround(1e9 * std::min(ScriptRestsUntil(scene, cart, session_time_s) - session_time_s, 1.0));
}

OperatedHands::OperatedHands(const config::CartConfig& cart, const SceneView& scene) : cart_(cart) {
  std::transform(scene.tools.begin(), scene.tools.end(), assists_.begin(),
                 [](const ToolDescription& tool) { return tool.assists(); });
  // The jaw of a scope is its zoom ring: wide.
  std::transform(scene.tools.begin(), scene.tools.end(), jaw_deg_.begin(),
                 [](const ToolDescription& tool) { return tool.kind == ToolKind::kScope ? 0 : kStartJaw_deg; });
}

SimulatedInput OperatedHands::Replace(SimulatedInput input, const OperatorInput* operated) {
  for (std::size_t tool = 0; tool < kMaxTools; ++tool) {
    if (cart_.handles[tool].kind != config::LinkKind::kOperator || assists_[tool]) continue;
    if (operated != nullptr && operated->tools[tool].moves) {
      jaw_deg_[tool] = kDegPerRad * static_cast<double>(operated->tools[tool].jaw_angle_rad);
    }
    input.jaw_deg[tool] = jaw_deg_[tool];
  }
  if (cart_.pedal.kind == config::LinkKind::kOperator) {
    input.pedals = operated != nullptr ? operated->pedals : std::uint8_t{kPedalNone};
  }
  return input;
}

}  // namespace fulcrum::handle_bridge
