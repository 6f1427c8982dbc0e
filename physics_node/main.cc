// physics_node: deforms the tissue under the tools at 100 Hz.
#include "physics_node/node/failover.h"
#include "physics_node/node/physics_checkpoint.h"
#include "physics_node/node/physics_node.h"
#include "physics_node/node/seat.h"
#include "services/base/runtime/checkpoint.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/nodes/app/node_app.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules

ExitCode RunPhysics(app::NodeApp& app) {
  const physics::Seat seat = physics::SeatOf(app.options().TakeValue("--pair", ""), app.options().TakeFlag("--follow"));
  const SceneView& scene = app.scene();
  runtime::CheckpointFile checkpoint(app.options().session / seat.own, scene.hash, physics::kCheckpointLayout,
                                     physics::CheckpointCapacity(static_cast<Index>(scene.rest_position.size())));
  const std::int64_t epoch_ns = runtime::MonotonicNs();
  const physics::PhysicsNode::Ports ports{
      app.MakeInput<ToolState>(),       app.MakeInput<HandleState>(),  app.MakeInput<TopologyState>(),
      app.MakeInput<OpenCells>(),       app.MakeOutput<TissueFrame>(), app.MakeOutput<ContactModel>(),
      app.MakeOutput<CauteryContact>(), app.MakeOutput<TearState>(),   app.MakeOutput<TickManifest>(),
      app.MakeOutput<ClipState>(),
  };
  const auto make = [&](bool follows, std::optional<physics::PhysicsNode>* node) {
    node->emplace(scene, ports, &checkpoint, epoch_ns, app.cart().timing(NodeId::kPhysics).threads, follows);
  };
  const auto run = [&](auto* node) {
    if (!seat.follows) app::LogCheckpoint(checkpoint, node->restored());
    return app.Run(
        app.timing(), [node](const Tick& tick) { node->Step(tick); },
        [node](Health* health) { node->FillHealth(health); });
  };
  if (seat.other.empty()) {
    std::optional<physics::PhysicsNode> node;
    make(false, &node);
    return run(&*node);
  }
  physics::Failover failover(scene, make, app.MakeInput<TickManifest>(), app.options().session / seat.other,
                             seat.follows, epoch_ns);
  return run(&failover);
}

}  // namespace

int main(int argc, char** argv) {
  return app::NodeMain(argc, argv, NodeId::kPhysics,
                       "Deforms the tissue under the tools; publishes TissueFrame, ContactModel and CauteryContact at "
                       "100 Hz.\n"
                       "--pair a|b: one of two processes; --follow: the one that waits and takes over.",
                       RunPhysics);
}
