// render_node: draws what the laparoscope sees, into a window (--window) or off screen into PNG files.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "render_node/node/render_node.h"
#include "services/app/node_app.h"
#include "services/runtime/realtime.h"

namespace {

// A software rasteriser takes every core it can get: below the servo and the solvers where they share cores.
constexpr int kNice = 5;

std::set<int> Threads() {
  std::set<int> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    threads.insert(std::atoi(entry.path().filename().c_str()));
  }
  return threads;
}

/// Of this thread, which draws, of the rasteriser's and of what they begin: all but those that came `earlier`, the
/// bus's.
void LowerPriorityOfDrawing(const std::set<int>& earlier) {
  for (const int thread : Threads()) {
    if ((thread == gettid() || !earlier.contains(thread)) && setpriority(PRIO_PROCESS, thread, kNice) != 0) {
      fulcrum::runtime::Log(fulcrum::runtime::LogLevel::kWarning, "cannot lower the priority of drawing");
      return;
    }
  }
}

fulcrum::ExitCode RunRender(fulcrum::app::NodeApp& app) {
  const std::set<int> earlier = Threads();
  fulcrum::render::RenderSettings settings;
  settings.window = app.options().TakeFlag("--window");
  settings.quality = fulcrum::render::QualityFromName(app.options().TakeValue("--quality", "auto"));
  settings.frames = app.options().session / "frames";
  fulcrum::render::RenderNode node(app.scene(), settings,
                                   {app.MakeInput<fulcrum::TissueFrame>(), app.MakeInput<fulcrum::TopologyState>(),
                                    app.MakeInput<fulcrum::TemperaturePatch>(), app.MakeInput<fulcrum::ToolState>(),
                                    app.MakeInput<fulcrum::HandleState>(), app.MakeInput<fulcrum::ThermalEvent>(),
                                    app.MakeInput<fulcrum::CauteryContact>()});
  fulcrum::runtime::Log(fulcrum::runtime::LogLevel::kInfo, node.display_description());
  // Not before: a node that comes back is waited for.
  LowerPriorityOfDrawing(earlier);

  // The scene says how many pictures it wants, the cart how many the machine can give: the slower of the two.
  fulcrum::runtime::CyclicThreadSettings timing = app.timing();
  timing.period_ns = std::max(timing.period_ns, std::int64_t{std::llround(1e9 / app.scene().render.rate_Hz)});
  bool seen = false;
  const fulcrum::ExitCode code = app.Run(
      timing,
      [&](const fulcrum::Tick& tick) {
        node.Step(tick);
        if (!seen && node.pictures_drawn() > 0) {
          seen = true;
          app.PublishHealthNow();  // A node that came back is waited for.
        }
        if (node.closed()) {
          app.Finish(fulcrum::ExitCode::kDone, "the window was closed");
        }
      },
      [&](fulcrum::Health* health) { node.FillHealth(health); });
  node.Finish();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  return fulcrum::app::NodeMain(argc, argv, fulcrum::NodeId::kRender,
                                "Draws what the laparoscope sees: off screen into PNG files, or --window.", RunRender);
}
