// Latency of a change of the generator's power in a real cart that cuts: from the command on its socket to the Health
// of thermal_node that reports the new set power.
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "services/base/runtime/cyclic_thread.h"
#include "services/session/supervisor/ask.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/cart_watch.h"
#include "tests/support/working_scene.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::CartState;

constexpr int kDomain = 93;
constexpr int kTurns = 40, kTurnsQuick = 8;
constexpr double kPatience_s = 30;

bool Sets(const CartState& state, double power_W) { return state.Metric(NodeId::kThermal, "set_power_W") == power_W; }

/// Empty, or what went wrong.
std::string Measure(int turns, const fs::path& scene, std::vector<double>* set_ms) {
  testing::Cart cart(scene, kDomain);
  testing::CartWatch watch(kDomain, scene, cart.session());
  if (!watch.WaitUntil(60, [](const CartState& state) { return Sets(state, 35); })) {
    return "the cart did not come to cut\n" + cart.Said();
  }
  for (int i = 0; i < turns; ++i) {
    // An interval that is not a multiple of any period.
    std::this_thread::sleep_for(std::chrono::milliseconds(201 + 7 * (i % 13)));
    const int power_W = i % 2 == 0 ? 50 : 35;
    const std::int64_t turned_ns = runtime::MonotonicNs();
    if (!supervisor::AskSupervisor(kDomain, "generator", "cut=" + std::to_string(power_W)).ok) return "was refused";
    std::int64_t told_ns = 0;
    const bool told = watch.WaitUntil(kPatience_s, [&](const CartState& state) {
      told_ns = runtime::MonotonicNs();
      return Sets(state, power_W);
    });
    if (!told) return "the setting was not taken\n" + cart.Said();
    set_ms->push_back(1e-6 * static_cast<double>(told_ns - turned_ns));
  }
  cart.Signal(SIGINT);
  return cart.WaitForEnd(kPatience_s) == 0 ? std::string() : "the session ended badly\n" + cart.Said();
}

int Run(benchmark::Report* report) {
  if (!report->Wants("generator.")) return 0;
  const fs::path folder = fs::temp_directory_path() / ("bench_generator." + std::to_string(::getpid()));
  fs::create_directories(folder);
  const fs::path scene = folder / "working.yaml";
  std::ofstream(scene) << testing::WorkingScene("built-in", 120);
  std::vector<double> set_ms;
  const std::string wrong = Measure(report->quick() ? kTurnsQuick : kTurns, scene, &set_ms);
  fs::remove_all(folder);
  if (!wrong.empty()) {
    std::fprintf(stderr, "bench_generator: %s\n", wrong.c_str());
    return 1;
  }
  report->Add("generator.set_to_power_ms", benchmark::Quantile(set_ms, 0.5), "ms");
  report->Add("generator.set_to_power_ms_max", benchmark::Quantile(set_ms, 1), "ms");
  return 0;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  return fulcrum::Run(&report);
}
