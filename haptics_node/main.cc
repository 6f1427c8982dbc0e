// haptics_node: the 1 kHz servo between the operator's hands and the tissue.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "haptics_node/calibrate_command.h"
#include "haptics_node/node/cart_devices.h"
#include "haptics_node/node/haptics_node.h"
#include "haptics_node/node/trocar_store.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/node_app.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules

// The bus thread runs below the servo, above the nodes at 100 Hz.
constexpr int kPriorityBelowServo = 20;

ExitCode RunHaptics(app::NodeApp& app) {
  haptics::CartDevices cart = haptics::MakeCartDevices(app.cart(), app.scene(), haptics::TrocarFolder());
  for (const std::string& note : cart.notes) Log(runtime::LogLevel::kInfo, note);
  if (cart.touch) cart.touch->Start();
  const auto bell = std::make_shared<runtime::Bell>();  // The ports outlive the node.
  const auto ring = [bell] { bell->Ring(); };
  haptics::HapticsNode node(app.scene(), std::move(cart.devices),
                            {app.MakeInput<ContactModel>(ring), app.MakeInput<OperatorInput>(ring),
                             app.MakeOutput<ToolState>(), app.MakeOutput<TickManifest>(), bell},
                            runtime::MonotonicNs());

  runtime::CyclicThreadSettings servo = app.timing();
  runtime::CyclicThreadSettings below = servo;
  below.name = "haptics_bus";
  below.fifo_priority = std::max(0, servo.fifo_priority - kPriorityBelowServo);
  below.spin_ns = 0;
  below.cpu = -1;
  servo.rests = node.resting();
  servo.rests_until = [&node] { return node.ServoRestsUntil(); };
  servo.bell = node.servo_bell();
  runtime::CyclicThread bus(below, [&](const Tick&) { node.BusTurn(); });
  bus.Start();
  return app.Run(
      servo, [&](const Tick& tick) { node.ServoStep(tick); }, [&](Health* health) { node.FillHealth(health); });
}

}  // namespace

int main(int argc, char** argv) {
  if (fulcrum::haptics::IsCalibrateCommand(argc, argv)) return fulcrum::haptics::CalibrateMain(argc, argv);
  return fulcrum::app::NodeMain(argc, argv, fulcrum::NodeId::kHaptics,
                                "Reads the devices, renders the forces of the tissue at 1 kHz, publishes ToolState.\n"
                                "`haptics_node calibrate-trocar --help`: measures the position of a trocar.",
                                RunHaptics);
}
