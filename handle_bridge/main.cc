// handle_bridge: jaw angles and foot pedal from serial lines, real or simulated, onto the bus.
#include <memory>
#include <optional>

#include "handle_bridge/node/calibrate_command.h"
#include "handle_bridge/node/cart_links.h"
#include "handle_bridge/node/handle_bridge_node.h"
#include "services/base/core/operator_choice.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/node_app.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules

ExitCode RunBridge(app::NodeApp& app) {
  using namespace fulcrum::handle_bridge;
  const config::CartConfig cart = ForScene(app.cart(), app.scene());
  const bool operated = HasLinks(cart, config::LinkKind::kOperator);
  const ScriptedHands scripted(app.scene(), cart);
  OperatedHands hands(cart, app.scene());
  OperatorChoice choice;
  OperatorInput sample;
  bus::Input<OperatorInput>* const inputs = operated ? &app.MakeInput<OperatorInput>() : nullptr;
  // Called on the firmware's thread. Sends nothing until the session time is known: after a restart during a session
  // the script's first key would be a wrong angle.
  const auto input_at = [&](std::int64_t now_ns) -> std::optional<SimulatedInput> {
    while (inputs != nullptr && inputs->TakeNext(&sample)) (void)choice.Add(sample);
    const double time_s = app.SessionTime(now_ns);
    if (time_s < 0) return std::nullopt;
    return hands.Replace(scripted.At(time_s), choice.At(now_ns));
  };
  const auto rests_until = [&](std::int64_t now_ns) {
    return now_ns + ScriptRest_ns(app.scene(), cart, app.SessionTime(now_ns));
  };
  runtime::Bell lines;
  const auto firmware = operated || HasLinks(cart, config::LinkKind::kSimulated)
                            ? std::make_unique<SimulatedFirmware>(input_at, MakeSimulatedUnits(cart),
                                                                  SimulatedFirmware::Rest{rests_until, &lines})
                            : nullptr;
  const CalibrationStore calibrations = CalibrationStore::Load(CalibrationFolder());
  runtime::Log(runtime::LogLevel::kInfo, calibrations.Describe());
  HandleBridgeNode node(cart, calibrations, MakeCartLinks(cart, firmware.get()), &app.MakeOutput<HandleState>(),
                        runtime::MonotonicNs(), NeedsButtons(cart) ? &app.MakeInput<ToolState>() : nullptr);
  runtime::CyclicThreadSettings timing = app.timing();
  timing.rests_until = [&node] { return node.RestsUntil(); };
  timing.bell = &lines;
  return app.Run(
      timing, [&node](const Tick& tick) { node.Step(tick); }, [&node](Health* health) { node.FillHealth(health); });
}

}  // namespace

int main(int argc, char** argv) {
  if (handle_bridge::IsCalibrateCommand(argc, argv)) return handle_bridge::CalibrateMain(argc, argv);
  return fulcrum::app::NodeMain(argc, argv, fulcrum::NodeId::kHandleBridge,
                                "Jaw angles and foot pedal from serial lines.\n"
                                "`handle_bridge calibrate --help`: calibrates a handle.",
                                RunBridge);
}
