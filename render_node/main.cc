// render_node: draws what the laparoscope sees, into a window (--window) or off screen into PNG files.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "render_node/node/drawing_threads.h"
#include "render_node/node/render_node.h"
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
  settings.quality = render::QualityFromName(app.options().TakeValue("--quality", "auto"));
  settings.frames = app.options().session / "frames";
  auto stage = render::MakeStage(app.scene(), settings.window, spare);
  if (spare && !app::WaitUntilNeeded(NodeId::kRender)) return ExitCode::kDone;

  // Before the ports: this thread, which draws, and the rasteriser's, not those of the bus.
  const std::vector<int> drawing = render::ThreadsOfProcess();
  const render::RenderPorts ports{app.MakeInput<TissueFrame>(),      app.MakeInput<TopologyState>(),
                                  app.MakeInput<TemperaturePatch>(), app.MakeInput<ToolState>(),
                                  app.MakeInput<HandleState>(),      app.MakeInput<ThermalEvent>(),
                                  app.MakeInput<CauteryContact>(),   app.MakeInput<GeneratorSetting>()};
  render::LowerPriority(drawing);
  render::RenderNode node(app.scene(), settings, ports, std::move(stage));
  runtime::Log(runtime::LogLevel::kInfo, node.display_description());

  // The scene says how many pictures it wants, the cart how many the machine can give: the slower of the two.
  runtime::CyclicThreadSettings timing = app.timing();
  timing.period_ns = std::max(timing.period_ns, std::int64_t{std::llround(1e9 / app.scene().render.rate_Hz)});
  bool seen = false;
  const auto step = [&](const Tick& tick) {
    node.Step(tick);
    if (!seen && node.pictures_drawn() > 0) {
      seen = true;
      app.PublishHealthNow();  // A node that came back is waited for.
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
