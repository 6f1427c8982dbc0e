// Rates of a cart at work beside a flood of malformed datagrams on the ports of its participants, against its rates
// just before.
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "services/base/runtime/cyclic_thread.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/cart_watch.h"
#include "tests/support/datagram_flood.h"
#include "tests/support/working_scene.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::CartState;

constexpr int kDomain = 94;
constexpr double kPatience_s = 60;
constexpr std::uint64_t kDatagrams = 60'000, kDatagramsQuick = 12'000;
constexpr double kPerSecond = 6000;

struct Node {
  NodeId id;
  const char* key;
};
constexpr std::array<Node, 4> kNodes{{{NodeId::kPhysics, "physics"},
                                      {NodeId::kThermal, "thermal"},
                                      {NodeId::kHaptics, "haptics"},
                                      {NodeId::kRender, "render"}}};

/// Progress of each node so far: steps, or pictures.
struct Work {
  std::array<double, kNodes.size()> count{};
  std::array<double, kNodes.size()> time_s{};
};

Work WorkOf(testing::CartWatch* watch) {
  return watch->See([](const CartState& state) {
    Work work;
    for (std::size_t i = 0; i < kNodes.size(); ++i) {
      const auto health = state.healths.find(kNodes[i].id);
      if (health == state.healths.end()) continue;
      work.count[i] = kNodes[i].id == NodeId::kRender ? state.Metric(NodeId::kRender, "frames_drawn")
                                                      : static_cast<double>(health->second.ticks);
      work.time_s[i] = 1e-9 * static_cast<double>(health->second.stamp.stamp_ns);
    }
    return work;
  });
}

double RateBetween(const Work& before, const Work& after, std::size_t node) {
  const double time_s = after.time_s[node] - before.time_s[node];
  return time_s > 0 ? (after.count[node] - before.count[node]) / time_s : 0;
}

int Run(benchmark::Report* report) {
  const fs::path folder = fs::temp_directory_path() / ("bench_flood." + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "working.yaml") << testing::WorkingScene("built-in", 120);
  int code = 1;
  {
    testing::Cart cart(folder / "working.yaml", kDomain);
    testing::CartWatch watch(kDomain, folder / "working.yaml", cart.session());
    const bool works = watch.WaitUntil(kPatience_s, [](const CartState& state) {
      return state.topology.revision > 0 && state.Metric(NodeId::kRender, "frames_drawn") > 5;
    });
    const std::uint64_t datagrams = report->quick() ? kDatagramsQuick : kDatagrams;
    const double time_s = static_cast<double>(datagrams) / kPerSecond;
    if (works) {
      const auto processes = cart.nodes();
      const Work begin = WorkOf(&watch);
      std::this_thread::sleep_for(std::chrono::duration<double>(time_s));
      const Work middle = WorkOf(&watch);
      const std::uint64_t sent = testing::FloodDomain(kDomain, datagrams, time_s, 1);
      const Work end = WorkOf(&watch);
      const auto left = cart.nodes();
      int ended = 0;
      for (const auto& [name, pid] : processes) {
        const auto now = left.find(name);
        ended += now == left.end() || now->second != pid ? 1 : 0;
      }
      report->Add("guard.flood.datagrams", static_cast<double>(sent), "1");
      report->Add("guard.flood.processes_ended", ended, "1");
      for (std::size_t i = 0; i < kNodes.size(); ++i) {
        const double before_Hz = RateBetween(begin, middle, i), beside_Hz = RateBetween(middle, end, i);
        report->Add(std::string("guard.flood_rate_pct.") + kNodes[i].key,
                    before_Hz > 0 ? 100 * beside_Hz / before_Hz : 0, "%");
      }
      code = 0;
    } else {
      std::fprintf(stderr, "bench_flood: the cart did not come to work\n%s\n", cart.Said().c_str());
    }
  }
  fs::remove_all(folder);
  return code;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  return report.Wants("guard.flood") ? fulcrum::Run(&report) : 0;
}
