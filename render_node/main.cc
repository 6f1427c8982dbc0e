// render_node: draws the picture of the laparoscope, into a window (--window) or off screen into PNG files.
#include <memory>
#include <utility>
#include <vector>

#include "render_node/node/drawing_threads.h"
#include "render_node/node/make_ports.h"
#include "render_node/node/render_node.h"
#include "render_node/offscreen/graphics_report.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/node_app.h"
#include "services/nodes/app/node_confinement.h"
#include "services/nodes/app/spare.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules

ExitCode RunRender(app::NodeApp& app) {
  const bool spare = app.options().TakeFlag("--spare");
  if (spare) app::BecomeSpare(NodeId::kRender);
  const bool hands = app.options().TakeFlag("--hands");
  const bool window = app.options().TakeFlag("--window") || hands;
  const render::RenderSettings settings{
      window, render::QualityFromName(app.options().TakeValue("--quality", "auto")), app.options().session / "frames",
      app.cart().inputs,
      // Half of what a recording leaves: the other half is for report and score at the end.
      static_cast<std::uint64_t>(0.5e6 * app.cart().recorder.keep_free_MB)};
  auto stage = render::MakeStage(app.scene(), settings.window, spare);
  if (spare && !app::WaitUntilNeeded(NodeId::kRender)) return ExitCode::kDone;
  // Collected before the ports start the threads of the bus: those that draw, this one and the rasteriser's.
  const std::vector<int> drawing = render::ThreadsOfProcess();
  const std::unique_ptr<bus::Input<OperatorInput>> operators = hands ? app.bus().MakeInput<OperatorInput>() : nullptr;
  const render::RenderPorts ports = render::MakePorts(app, hands, operators.get());
  render::LowerPriority(drawing);
  render::RenderNode node(app.scene(), settings, ports, std::move(stage));
  runtime::Log(runtime::LogLevel::kInfo, node.display_description());

  runtime::CyclicThreadSettings timing = app.timing();
  timing.period_ns = node.PeriodNs(timing.period_ns);
  bool seen = false;
  const auto step = [&](const Tick& tick) {
    node.Step(tick);
    // After a restart the session waits for this Health.
    if (node.pictures_drawn() > 0 && !std::exchange(seen, true)) app.PublishHealthNow();
    if (node.closed()) app.Finish(ExitCode::kDone, "the window was closed");
  };
  const ExitCode code = app.Run(timing, step, [&](Health* health) { node.FillHealth(health); });
  node.Finish();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  if (render::AsksForGraphics(argc, argv)) return static_cast<int>(render::PrintGraphics(app::ConfineGraphics));
  constexpr const char* kPurpose = "Draws what the laparoscope sees; --graphics alone prints what draws off screen.";
  return app::NodeMain(argc, argv, NodeId::kRender, kPurpose, RunRender);
}
