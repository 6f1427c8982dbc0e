#include "services/session/supervisor/scene_forecast.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <thread>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/runtime/child_process.h"
#include "services/base/runtime/realtime.h"

namespace fulcrum::supervisor {
namespace {
namespace fs = std::filesystem;

/// physics_node simulates at most so many periods in a step: with longer steps the tissue falls behind.
constexpr double kMostPeriodsOfAStep = 3;

std::optional<StepForecast> ReadForecast(const fs::path& file) {
  std::ifstream in(file);
  StepForecast forecast;
  std::string key, unit;
  for (double* value : {&forecast.period_ms, &forecast.all_ms, &forecast.working_ms}) {
    if (!(in >> key >> *value >> unit) || !(*value >= 0) || !std::isfinite(*value)) return std::nullopt;
  }
  return forecast.period_ms > 0 ? std::optional(forecast) : std::nullopt;
}

/// Writes `target`, with a word instead of figures where the scene cannot be measured.
void MeasureForecast(const fs::path& scene, const fs::path& profiler, int threads, const fs::path& target) {
  std::printf("measuring a step ...\n");
  std::fflush(stdout);
  fs::path log = target, made = target;
  log += ".log";
  made += "." + std::to_string(::getpid());
  const std::vector<std::string> arguments{scene.string(), "--threads", std::to_string(threads), "--forecast",
                                           made.string()};
  runtime::ChildProcess child = runtime::ChildProcess::Start(profiler, arguments, log);
  for (;;) {
    if (const auto end = child.Poll()) {
      if (end->signal != 0 || end->exit_code != 0) {
        std::printf("a step cannot be measured: scene_profiler %s; see %s\n", end->Describe().c_str(), log.c_str());
        std::ofstream(made) << "unknown\n";
      } else {
        std::error_code error;
        fs::remove(log, error);
      }
      fs::rename(made, target);
      return;
    }
    if (runtime::ShouldStop()) throw InputError("stopped while measuring a step of the scene");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

std::string ShortNumber(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), value < 10 ? "%.1f" : "%.0f", value);
  return text;
}

}  // namespace

std::string Describe(const StepForecast& forecast) {
  const double step_ms = kSessionOverStep * (forecast.working_ms > 0 ? forecast.working_ms : forecast.all_ms);
  std::string line = "expected: steps of about " + ShortNumber(step_ms) + " ms";
  if (forecast.working_ms > 0) {
    line += " while tools work, up to " + ShortNumber(std::max(step_ms, kSessionOverStep * forecast.all_ms)) +
            " ms when all tissue moves";
  }
  line += "; the period is " + ShortNumber(forecast.period_ms) + " ms: ";
  // A step that takes longer than a period begins with the period after the next.
  const double periods = std::ceil(step_ms / forecast.period_ms);
  if (periods <= 1) return line + "in time";
  line += "about " + ShortNumber(1e3 / (periods * forecast.period_ms)) + " of " +
          ShortNumber(1e3 / forecast.period_ms) + " Hz";
  const double pace = kMostPeriodsOfAStep / periods;
  if (pace < 1) line += ", tissue at " + ShortNumber(100 * pace) + " % of real time";
  return line + ". Faster: physics.preset fast, a coarser mesh of what the tools reach (fulcrum profile compares)";
}

std::string ForecastOf(const fs::path& scene, const fs::path& cache, const fs::path& profiler, int threads) {
  std::error_code error;
  if (!fs::equivalent(scene.parent_path(), cache, error) || error) return {};
  fs::path file = scene;
  file += ".forecast" + std::to_string(threads);
  try {
    if (!fs::exists(file)) {
      if (!fs::exists(profiler)) return {};
      MeasureForecast(scene, profiler, threads, file);
    }
  } catch (const fs::filesystem_error&) {
    return {};  // The folder cannot be written.
  } catch (const InputError&) {
    if (runtime::ShouldStop()) throw;
    return {};  // The program cannot be started, or its log not opened.
  }
  const auto forecast = ReadForecast(file);
  return forecast ? Describe(*forecast) : std::string();
}

}  // namespace fulcrum::supervisor
