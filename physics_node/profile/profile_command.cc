#include "physics_node/profile/profile_command.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "physics_node/profile/forecast.h"
#include "physics_node/profile/scene_profile.h"
#include "services/base/core/error.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum::physics {
namespace {

struct Options {
  std::string scene, json, forecast;
  ProfileSettings settings;
};

double Number(const std::string& option, const std::string& text, double least, double most) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(value >= least && value <= most)) {
    throw InputError(option + " \"" + text + "\": valid: " + std::to_string(static_cast<long>(least)) + " to " +
                     std::to_string(static_cast<long>(most)));
  }
  return value;
}

Options ParseOptions(const std::vector<std::string>& words) {
  Options options;
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  options.settings.reference_threads = cores;
  options.settings.most_threads = std::max(1, cores - kCoresOfOthers);
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (!word.starts_with("--")) {
      options.scene = word;
      continue;
    }
    if (i + 1 == words.size()) throw InputError(word + " needs a value");
    const std::string& value = words[++i];
    if (word == "--seconds") {
      options.settings.seconds = Number(word, value, 1, 3600);
    } else if (word == "--threads") {
      options.settings.most_threads = static_cast<int>(Number(word, value, 1, 64));
    } else if (word == "--json") {
      options.json = value;
    } else if (word == "--forecast") {
      options.forecast = value;
    } else {
      throw InputError("unknown option " + word + "; see fulcrum help profile");
    }
  }
  if (options.scene.empty())
    throw InputError("usage: scene_profiler FILE [--seconds S] [--threads N] [--json FILE] [--forecast FILE]");
  return options;
}

/// On a terminal a line that is written over; elsewhere a line for each part of the work.
class Progress {
 public:
  void operator()(std::string_view what, double share) {
    const bool next = what != what_;
    const int percent = static_cast<int>(100 * share);
    if (!next && (!terminal_ || percent == percent_)) return;
    what_ = what;
    percent_ = percent;
    const int length = static_cast<int>(what.size());
    if (terminal_) {
      std::fprintf(stderr, "\r%-12.*s %3d %% ", length, what.data(), percent);
    } else {
      std::fprintf(stderr, "%.*s ...\n", length, what.data());
    }
    std::fflush(stderr);
  }
  void End() const {
    if (terminal_) std::fprintf(stderr, "\r%20s\r", "");
  }

 private:
  const bool terminal_ = ::isatty(STDERR_FILENO) != 0;
  std::string what_;
  int percent_ = -1;
};

void Print(const SceneProfile& profile, const Advice& advice) {
  std::printf("%-10s %8s %8s %8s %8s %8s %8s %8s\n", "preset", "p50 ms", "p99 ms", "awake %", "place %", "force %",
              "deep mm", "period");
  for (const PresetFigures& p : profile.presets) {
    std::printf("%-10s %8.2f %8.2f %8.0f %8.2f %8.1f %8.2f %8.0f\n", NameOf(p.preset).data(), p.step_p50_ms,
                p.step_p99_ms, 100 * p.awake, 100 * p.position_error, 100 * p.force_error, p.deepest_mm,
                profile.period_ms);
  }
  std::printf("\n%-10s", "ms a step");
  for (std::size_t i = 0; i < kStages; ++i) std::printf(" %13s", NameOf(static_cast<Stage>(i)).data());
  for (const PresetFigures& p : profile.presets) {
    std::printf("\n%-10s", NameOf(p.preset).data());
    for (const double ms : p.stage_ms) std::printf(" %13.3f", ms);
  }
  std::printf("\n\n%-10s %8s %8s\n", "threads", "p50 ms", "p99 ms");
  for (const ThreadFigures& t : profile.threads) {
    std::printf("%-10d %8.2f %8.2f\n", t.threads, t.step_p50_ms, t.step_p99_ms);
  }
  std::printf(
      "\n%s: physics.preset %s in the scene, nodes.physics_node.threads %d in the cart; a step in a session: p99 "
      "%.1f of %.0f ms\n",
      advice.in_time ? "use" : "no preset is in time; the least late", NameOf(advice.preset).data(), advice.threads,
      advice.forecast_p99_ms, profile.period_ms);
}

/// Keys as `deploy/bench` prints them.
void WriteJson(const SceneProfile& profile, const Advice& advice, const std::string& file) {
  std::ofstream json(file);
  json << "{\n  \"profile.period_ms\": " << profile.period_ms;
  for (const PresetFigures& p : profile.presets) {
    const std::string stem = "profile." + std::string(NameOf(p.preset)) + ".";
    const auto add = [&](const std::string& key, double value) { json << ",\n  \"" << stem << key << "\": " << value; };
    add("step_ms_p50", p.step_p50_ms);
    add("step_ms_p99", p.step_p99_ms);
    add("awake_pct", 100 * p.awake);
    add("position_error_pct", 100 * p.position_error);
    add("force_error_pct", 100 * p.force_error);
    add("deepest_mm", p.deepest_mm);
    for (std::size_t i = 0; i < kStages; ++i) add(std::string(NameOf(static_cast<Stage>(i))) + "_ms", p.stage_ms[i]);
  }
  for (const ThreadFigures& t : profile.threads) {
    json << ",\n  \"profile.threads_" << t.threads << ".step_ms_p99\": " << t.step_p99_ms;
  }
  json << ",\n  \"profile.advice.preset\": \"" << NameOf(advice.preset)
       << "\",\n  \"profile.advice.threads\": " << advice.threads
       << ",\n  \"profile.advice.forecast_ms_p99\": " << advice.forecast_p99_ms
       << ",\n  \"profile.advice.in_time\": " << (advice.in_time ? "true" : "false") << "\n}\n";
  if (!json.flush()) throw InputError(file + ": cannot be written");
}

/// `key value unit`, a line each.
void WriteForecast(const Forecast& forecast, const std::string& file) {
  std::ofstream out(file);
  out << "forecast.period_ms " << forecast.period_ms << " ms\nforecast.all_ms " << forecast.all_ms
      << " ms\nforecast.working_ms " << forecast.working_ms << " ms\n";
  if (!out.flush()) throw InputError(file + ": cannot be written");
}

}  // namespace

ExitCode ProfileCommand(const std::vector<std::string>& words) {
  const Options options = ParseOptions(words);
  const scene::SceneFile scene(options.scene);
  if (!options.forecast.empty()) {
    WriteForecast(ForecastScene(scene.view(), options.settings.most_threads), options.forecast);
    return ExitCode::kDone;
  }
  Progress progress;
  const SceneProfile profile = ProfileScene(scene.view(), options.settings, std::ref(progress));
  progress.End();
  const Advice advice = AdviceOf(profile);
  Print(profile, advice);
  if (!options.json.empty()) WriteJson(profile, advice, options.json);
  return advice.in_time ? ExitCode::kDone : ExitCode::kFailure;
}

}  // namespace fulcrum::physics
