// render_node: draws the picture of the laparoscope, into a window (--window) or off screen into PNG files.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "render_node/node/drawing_threads.h"
#include "render_node/node/render_node.h"
#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/node_app.h"
#include "services/nodes/app/spare.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules

ExitCode RunRender(app::NodeApp& app) {
  const bool spare = app.options().TakeFlag("--spare");
  if (spare) app::BecomeSpare(NodeId::kRender);
  render::RenderSettings settings;
  settings.window = app.options().TakeFlag("--window");
  const bool hands = app.options().TakeFlag("--hands");
  if (hands && !settings.window) throw InputError("--hands goes with --window");
  settings.epoch_ns = runtime::MonotonicNs();
  settings.quality = render::QualityFromName(app.options().TakeValue("--quality", "auto"));
  settings.frames = app.options().session / "frames";
  auto stage = render::MakeStage(app.scene(), settings.window, spare);
  if (spare && !app::WaitUntilNeeded(NodeId::kRender)) return ExitCode::kDone;

  // Collected before the ports are created: the threads that draw, this one and the rasteriser's, without those of the
  // bus.
  const std::vector<int> drawing = render::ThreadsOfProcess();
  const render::RenderPorts ports{app.MakeInput<TissueFrame>(),
                                  app.MakeInput<TopologyState>(),
                                  app.MakeInput<TemperaturePatch>(),
                                  app.MakeInput<ToolState>(),
                                  app.MakeInput<HandleState>(),
                                  app.MakeInput<ThermalEvent>(),
                                  app.MakeInput<CauteryContact>(),
                                  app.MakeInput<GeneratorSetting>(),
                                  hands ? &app.MakeOutput<OperatorInput>() : nullptr};
  render::LowerPriority(drawing);
  render::RenderNode node(app.scene(), settings, ports, std::move(stage));
  runtime::Log(runtime::LogLevel::kInfo, node.display_description());

  // The scene sets the wanted rate of pictures, the cart the rate that the machine can reach; the lower one is used.
  runtime::CyclicThreadSettings timing = app.timing();
  timing.period_ns = std::max(timing.period_ns, std::int64_t{std::llround(1e9 / app.scene().render.rate_Hz)});
  bool seen = false;
  const auto step = [&](const Tick& tick) {
    node.Step(tick);
    if (!seen && node.pictures_drawn() > 0) {
      seen = true;
      app.PublishHealthNow();  // After a restart the session waits for this Health.
    }
    if (node.closed()) app.Finish(ExitCode::kDone, "the window was closed");
  };
  const ExitCode code = app.Run(timing, step, [&](Health* health) { node.FillHealth(health); });
  node.Finish();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  return app::NodeMain(argc, argv, NodeId::kRender,
                       "Draws what the laparoscope sees: off screen into PNG files, or --window.", RunRender);
}
