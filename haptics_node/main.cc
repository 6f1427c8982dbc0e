// haptics_node: the 1 kHz servo between the operator's hands and the tissue.
#include <algorithm>
#include <array>

#include "haptics_node/node/haptics_node.h"
#include "services/app/node_app.h"
#include "services/runtime/cyclic_thread.h"

namespace {

using fulcrum::Tick;

// The bus thread runs below the servo, above the nodes at 100 Hz.
constexpr int kPriorityBelowServo = 20;

fulcrum::ExitCode RunHaptics(fulcrum::app::NodeApp& app) {
  std::array<bool, fulcrum::kMaxTools> simulated{};
  for (std::size_t i = 0; i < simulated.size(); ++i) {
    simulated[i] = app.cart().devices[i] == fulcrum::config::DeviceKind::kSimulated;
  }
  fulcrum::haptics::HapticsNode node(app.scene(), simulated,
                                     {app.MakeInput<fulcrum::ContactModel>(), app.MakeOutput<fulcrum::ToolState>(),
                                      app.MakeOutput<fulcrum::TickManifest>()},
                                     fulcrum::runtime::MonotonicNs());

  const fulcrum::runtime::CyclicThreadSettings servo = app.timing();
  fulcrum::runtime::CyclicThreadSettings below = servo;
  below.name = "haptics_bus";
  below.fifo_priority = std::max(0, servo.fifo_priority - kPriorityBelowServo);
  below.spin_ns = 0;
  below.cpu = -1;
  fulcrum::runtime::CyclicThread bus(below, [&](const Tick&) { node.BusStep(); });
  bus.Start();
  return app.Run(
      servo, [&](const Tick& tick) { node.ServoStep(tick); },
      [&](fulcrum::Health* health) { node.FillHealth(health); });
}

}  // namespace

int main(int argc, char** argv) {
  return fulcrum::app::NodeMain(argc, argv, fulcrum::NodeId::kHaptics,
                                "Reads the devices, renders the forces of the tissue, publishes ToolState at 1 kHz.",
                                RunHaptics);
}
