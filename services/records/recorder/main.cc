// recorder: every topic of the cart into a file, the newest seconds into dumps.
#include "services/nodes/app/node_app.h"
#include "services/records/recorder/recorder_node.h"
#include "services/records/recorder/settings.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules

ExitCode RunRecorder(app::NodeApp& app) {
  recorder::RecorderNode node(&app, recorder::TakeSettings(&app));
  const ExitCode code = app.Run(
      app.timing(), [&](const Tick& tick) { node.Step(tick); }, [&](Health* health) { node.FillHealth(health); });
  node.Close();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  return app::NodeMain(argc, argv, NodeId::kRecorder,
                       "Every topic of the cart into a file (--file FILE), and the newest seconds (--keep\n"
                       "SECONDS) into dumps when a node dies or is degraded, or `fulcrum dump` asks for\none.",
                       RunRecorder);
}
