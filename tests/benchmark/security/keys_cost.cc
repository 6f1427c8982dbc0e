#include "tests/benchmark/security/keys_cost.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/cart.h"

namespace fulcrum {
namespace {

constexpr int kKeysDomain = 76;
constexpr std::array kNodes{"handle_bridge", "haptics_node", "physics_node", "thermal_node", "render_node"};
constexpr double kKeysPatience_s = 60;
constexpr double kSession_s = 8;

struct Run {
  double start_ms = 0;  ///< From the start of `fulcrum up` until every node has joined.
  std::array<double, kNodes.size()> rate_Hz{};
};

/// One session of `small`. @return false: it did not start or end.
bool Measure(bool open, Run* run) {
  std::vector<std::string> arguments{"--seconds", std::to_string(kSession_s)};
  if (open) arguments.emplace_back("--open-bus");
  const auto begin = std::chrono::steady_clock::now();
  testing::Cart cart("small", kKeysDomain, arguments);
  const auto joined = [&](const char* node) {
    return testing::ReadFile(cart.session() / "logs" / (std::string(node) + ".log")).find("joined session") !=
           std::string::npos;
  };
  while (!std::all_of(kNodes.begin(), kNodes.end(), joined)) {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    if (passed.count() > kKeysPatience_s) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  run->start_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  if (!cart.WaitForEnd(kKeysPatience_s)) return false;
  const std::string summary = testing::ReadFile(cart.session() / "summary.json");
  for (std::size_t i = 0; i < kNodes.size(); ++i) {
    run->rate_Hz[i] = testing::FigureOf(summary, std::string(kNodes[i]) + ".rate_achieved_Hz");
  }
  return true;
}

}  // namespace

std::string MeasureKeysCost(benchmark::Report* report) {
  std::array<std::vector<double>, 2> start_ms;
  std::array<std::array<std::vector<double>, kNodes.size()>, 2> rates_Hz;
  // In turns, because the machine is not the same from one minute to the next. The first session compiles the scene.
  for (int i = 0; i < (report->quick() ? 4 : 21); ++i) {
    for (const bool open : {true, false}) {
      Run run;
      if (!Measure(open, &run)) return "a session did not start or end";
      if (i == 0) continue;
      start_ms[open ? 1 : 0].push_back(run.start_ms);
      for (std::size_t n = 0; n < kNodes.size(); ++n) rates_Hz[open ? 1 : 0][n].push_back(run.rate_Hz[n]);
    }
  }
  const double keyed_ms = benchmark::Quantile(start_ms[0], 0.5), open_ms = benchmark::Quantile(start_ms[1], 0.5);
  report->Add("guard.start_ms_p50.keys", keyed_ms, "ms");
  report->Add("guard.start_ms_p50.open", open_ms, "ms");
  report->Add("guard.keys_start_extra_ms_p50", keyed_ms - open_ms, "ms");
  double change_pct = 0;
  for (std::size_t n = 0; n < kNodes.size(); ++n) {
    const double keyed = benchmark::Quantile(rates_Hz[0][n], 0.5), open = benchmark::Quantile(rates_Hz[1][n], 0.5);
    const double pct = 100 * (keyed - open) / open;
    report->Add(std::string("guard.rate_change_pct.") + kNodes[n], pct, "%");
    change_pct = std::max(change_pct, -pct);
  }
  report->Add("guard.rate_change_pct", change_pct, "%");
  return {};
}

}  // namespace fulcrum
