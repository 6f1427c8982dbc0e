// physics_node: deforms the tissue under the tools at 100 Hz.
#include "physics_node/node/physics_checkpoint.h"
#include "physics_node/node/physics_node.h"
#include "services/app/node_app.h"
#include "services/runtime/checkpoint.h"
#include "services/runtime/cyclic_thread.h"

namespace {

fulcrum::ExitCode RunPhysics(fulcrum::app::NodeApp& app) {
  using namespace fulcrum;
  const auto particles = static_cast<Index>(app.scene().rest_position.size());
  runtime::CheckpointFile checkpoint(app.options().session / "physics_node.checkpoint", app.scene().hash,
                                     physics::kCheckpointLayout, physics::CheckpointCapacity(particles));
  physics::PhysicsNode node(app.scene(),
                            {app.MakeInput<ToolState>(), app.MakeInput<HandleState>(), app.MakeInput<TopologyState>(),
                             app.MakeOutput<TissueFrame>(), app.MakeOutput<ContactModel>(),
                             app.MakeOutput<CauteryContact>(), app.MakeOutput<TickManifest>()},
                            &checkpoint, runtime::MonotonicNs(), app.cart().timing(NodeId::kPhysics).threads);
  app::LogCheckpoint(checkpoint, node.restored());
  return app.Run(
      app.timing(), [&](const Tick& tick) { node.Step(tick); }, [&](Health* health) { node.FillHealth(health); });
}

}  // namespace

int main(int argc, char** argv) {
  return fulcrum::app::NodeMain(argc, argv, fulcrum::NodeId::kPhysics,
                                "Deforms the tissue under the tools; publishes TissueFrame, ContactModel and "
                                "CauteryContact at 100 Hz.",
                                RunPhysics);
}
