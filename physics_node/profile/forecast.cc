#include "physics_node/profile/forecast.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <vector>

#include "physics_node/profile/quantile.h"
#include "physics_node/simulation/script_player.h"
#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {
namespace {

/// Steps until tissue sleeps, at most: it does after 50 still ones.
constexpr int kMostSettling = 80;
/// Steps with the tools: to their place, at 1 m/s, and those that count.
constexpr int kApproach = 30, kWorking = 50;

/// The middle of the first stroke with a pedal pressed, where its tool is fastest; that of the script if there is none.
double WorkBegins(const SceneView& scene) {
  const double end_s = static_cast<double>(scene.script_duration_s);
  double begin_s = end_s, middle_s = 0.5 * end_s;
  for (std::size_t i = 0; i + 1 < scene.script.size(); ++i) {
    const ScriptKey &key = scene.script[i], &next = scene.script[i + 1];
    const auto from_s = static_cast<double>(key.time_s);
    if (key.pedals == kPedalNone || next.tool != key.tool || from_s >= begin_s) continue;
    begin_s = from_s;
    middle_s = 0.5 * (from_s + static_cast<double>(next.time_s));
  }
  return middle_s;
}

}  // namespace

Forecast ForecastScene(const SceneView& scene, int threads) {
  TissueSimulation simulation(scene, threads);
  const auto step_ms = [&](const std::array<ToolInput, kMaxTools>& tools) {
    const auto begin = std::chrono::steady_clock::now();
    (void)simulation.Step(tools);
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) (void)simulation.Contacts(tool);
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  };
  Forecast forecast;
  const double period_s = static_cast<double>(scene.physics.dt_s);
  forecast.period_ms = 1e3 * period_s;
  // Tissue that comes from a checkpoint is awake, also in a scene that begins asleep.
  std::vector<float> rest(3 * scene.rest_position.size());
  simulation.particles().CopyPositions(rest);
  (void)simulation.Restore(rest, rest, {});
  std::vector<double> all;
  for (int i = 0; i < kMostSettling && !simulation.asleep(); ++i) all.push_back(step_ms({}));
  forecast.all_ms = Quantile(all, 0.5);
  if (scene.script.empty()) return forecast;
  const double begin_s = std::max(WorkBegins(scene) - 0.5 * kWorking * period_s, 0.0);
  for (int i = 0; i < kApproach; ++i) (void)step_ms(ScriptedTools(scene, begin_s));
  std::vector<double> working;
  for (int i = 1; i <= kWorking; ++i) working.push_back(step_ms(ScriptedTools(scene, begin_s + i * period_s)));
  forecast.working_ms = Quantile(working, 0.5);
  forecast.working_awake = static_cast<double>(simulation.awake_part());
  return forecast;
}

}  // namespace fulcrum::physics
