// handle_bridge: jaw angles and foot pedal from serial lines, real or simulated, onto the bus.
#include <memory>
#include <optional>

#include "handle_bridge/node/calibrate_command.h"
#include "handle_bridge/node/cart_links.h"
#include "handle_bridge/node/handle_bridge_node.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/node_app.h"

namespace {

fulcrum::ExitCode RunBridge(fulcrum::app::NodeApp& app) {
  using namespace fulcrum::handle_bridge;
  // Sends nothing until the session time is known: after a restart during a session the script's first key would be a
  // wrong angle.
  const auto follow_script = [&app](std::int64_t now_ns) -> std::optional<OperatorInput> {
    const double time_s = app.SessionTime(now_ns);
    return time_s < 0 ? std::nullopt : std::optional(FollowScript(app.scene(), app.cart(), time_s));
  };
  const auto firmware = HasSimulatedLinks(app.cart())
                            ? std::make_unique<SimulatedFirmware>(follow_script, MakeSimulatedUnits(app.cart()))
                            : nullptr;
  const CalibrationStore calibrations = CalibrationStore::Load(CalibrationFolder());
  fulcrum::runtime::Log(fulcrum::runtime::LogLevel::kInfo, calibrations.Describe());
  HandleBridgeNode node(app.cart(), calibrations, MakeCartLinks(app.cart(), firmware.get()),
                        &app.MakeOutput<fulcrum::HandleState>(), fulcrum::runtime::MonotonicNs());
  return app.Run(
      app.timing(), [&node](const fulcrum::Tick& tick) { node.Step(tick); },
      [&node](fulcrum::Health* health) { node.FillHealth(health); });
}

}  // namespace

int main(int argc, char** argv) {
  if (fulcrum::handle_bridge::IsCalibrateCommand(argc, argv)) {
    return fulcrum::handle_bridge::CalibrateMain(argc, argv);
  }
  return fulcrum::app::NodeMain(argc, argv, fulcrum::NodeId::kHandleBridge,
                                "Jaw angles and foot pedal from serial lines.\n"
                                "`handle_bridge calibrate --help`: calibrates a handle.",
                                RunBridge);
}
