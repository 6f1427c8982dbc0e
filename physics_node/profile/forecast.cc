#include "physics_node/profile/forecast.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "physics_node/simulation/script_player.h"
#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {
namespace {

/// Steps until tissue sleeps, at most: it does after 50 still ones.
constexpr int kMostSettling = 80;
/// Steps with the tools: to their place, at 1 m/s, and those that count.
constexpr int kApproach = 30, kWorking = 50;

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// When a pedal is first pressed; the middle of the script if none is.
double WorkBegins(const SceneView& scene) {
  double begin_s = static_cast<double>(scene.script_duration_s);
  bool found = false;
  for (const ScriptKey& key : scene.script) {
    if (key.pedals == kPedalNone) continue;
    begin_s = std::min(begin_s, static_cast<double>(key.time_s));
    found = true;
  }
  return found ? begin_s : 0.5 * begin_s;
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
  std::vector<double> all;
  for (int i = 0; i < kMostSettling && !simulation.asleep(); ++i) all.push_back(step_ms({}));
  forecast.all_ms = Median(all);
  if (scene.script.empty()) return forecast;
  const double begin_s = WorkBegins(scene);
  for (int i = 0; i < kApproach; ++i) (void)step_ms(ScriptedTools(scene, begin_s));
  std::vector<double> working;
  for (int i = 1; i <= kWorking; ++i) working.push_back(step_ms(ScriptedTools(scene, begin_s + i * period_s)));
  forecast.working_ms = Median(working);
  forecast.working_awake = static_cast<double>(simulation.awake_part());
  return forecast;
}

}  // namespace fulcrum::physics
