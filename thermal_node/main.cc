// thermal_node: electrocautery of membrane and organs.
#include "services/base/runtime/checkpoint.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/nodes/app/node_app.h"
#include "thermal_node/node/thermal_node.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules

ExitCode RunThermal(app::NodeApp& app) {
  runtime::CheckpointFile checkpoint(app.options().session / "thermal_node.checkpoint", app.scene().hash,
                                     thermal::kCheckpointLayout, thermal::ThermalNode::CheckpointCapacity(app.scene()));
  thermal::ThermalNode node(
      app.scene(),
      {app.MakeInput<CauteryContact>(), app.MakeInput<TearState>(), app.MakeInput<HandleState>(),
       app.MakeInput<GeneratorSetting>(), app.MakeOutput<TopologyState>(), app.MakeOutput<OpenCells>(),
       app.MakeOutput<TemperaturePatch>(), app.MakeOutput<ThermalEvent>(), app.MakeOutput<TickManifest>()},
      &checkpoint, runtime::MonotonicNs());
  app::LogCheckpoint(checkpoint, node.restored());
  return app.Run(
      app.timing(),
      [&](const Tick& tick) {
        node.Step(tick);
        // A change of the set power is published at once, not with the next period of Health.
        if (node.TakeSettingChanged()) app.PublishHealthNow();
      },
      [&](Health* health) { node.FillHealth(health); });
}

}  // namespace

int main(int argc, char** argv) {
  return app::NodeMain(argc, argv, NodeId::kThermal,
                       "Heats membrane and organs, cuts the membrane; publishes topology and temperature.", RunThermal);
}
