// render_node: draws what the laparoscope sees, into a window (--window) or off screen into PNG files.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "render_node/node/render_node.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/node_app.h"
#include "services/nodes/app/spare.h"

namespace {

// A software rasteriser takes every core it can get: below the servo and the solvers where they share cores.
constexpr int kNice = 5;

std::vector<int> Threads() {
  std::vector<int> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    threads.push_back(std::atoi(entry.path().filename().c_str()));
  }
  return threads;
}

/// Of these threads and of what they begin.
void LowerPriority(std::span<const int> threads) {
  for (const int thread : threads) {
    if (setpriority(PRIO_PROCESS, static_cast<id_t>(thread), kNice) != 0) {
      fulcrum::runtime::Log(fulcrum::runtime::LogLevel::kWarning, "cannot lower the priority of drawing");
      return;
    }
  }
}

/// A node that comes back is waited for, a spare is not: its thread, and the rasteriser's with it, give way from the
/// first.
std::unique_ptr<fulcrum::render::Stage> MakeStage(const fulcrum::SceneView& scene, bool window, bool spare) {
  const auto make = [&] {
    if (spare) LowerPriority(std::array{gettid()});
    return std::make_unique<fulcrum::render::Stage>(scene, window);
  };
  return std::async(spare ? std::launch::async : std::launch::deferred, make).get();
}

fulcrum::ExitCode RunRender(fulcrum::app::NodeApp& app) {
  const bool spare = app.options().TakeFlag("--spare");
  if (spare) fulcrum::app::BecomeSpare(fulcrum::NodeId::kRender);
  fulcrum::render::RenderSettings settings;
  settings.window = app.options().TakeFlag("--window");
  settings.quality = fulcrum::render::QualityFromName(app.options().TakeValue("--quality", "auto"));
  settings.frames = app.options().session / "frames";
  auto stage = MakeStage(app.scene(), settings.window, spare);
  if (spare && !fulcrum::app::WaitUntilNeeded(fulcrum::NodeId::kRender)) return fulcrum::ExitCode::kDone;

  // This one, which draws, and the rasteriser's, not those of the bus.
  const std::vector<int> drawing = Threads();
  const fulcrum::render::RenderPorts ports{
      app.MakeInput<fulcrum::TissueFrame>(),      app.MakeInput<fulcrum::TopologyState>(),
      app.MakeInput<fulcrum::TemperaturePatch>(), app.MakeInput<fulcrum::ToolState>(),
      app.MakeInput<fulcrum::HandleState>(),      app.MakeInput<fulcrum::ThermalEvent>(),
      app.MakeInput<fulcrum::CauteryContact>(),   app.MakeInput<fulcrum::GeneratorSetting>()};
  LowerPriority(drawing);
  fulcrum::render::RenderNode node(app.scene(), settings, ports, std::move(stage));
  fulcrum::runtime::Log(fulcrum::runtime::LogLevel::kInfo, node.display_description());

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
