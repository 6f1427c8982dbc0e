// The model's elements against theory, with the order in which the errors vanish. Organ at Poisson's ratio 0.45.
#include <cmath>
#include <functional>
#include <map>
#include <string>

#include "tests/benchmark/report.h"
#include "tests/numerics/physics/analytic_cases.h"

namespace fulcrum::physics {
namespace {

constexpr double kPoisson = 0.45;

void RunAll(benchmark::Report* report) {
  // Key, error on a mesh of n, the mesh whose error is reported, and the mesh whose order is measured (against one
  // twice as fine).
  const auto run = [&](const std::string& name, const std::function<double(int)>& error, int told, int base,
                       const std::function<double(int)>& for_order) {
    const std::string key = "physics.analytic." + name;
    if (report->Wants(key)) {
      report->Add(key + "_error_pct", 100 * std::abs(error(told)), "%");
      report->Add(key + "_order", std::log2(std::abs(for_order(base) / for_order(2 * base))), "1");
    }
  };
  std::map<int, BarErrors> bars;
  const auto bar = [&bars](int n) {
    const auto [at, is_new] = bars.try_emplace(n);
    if (is_new) {
      at->second = HangingBar(n, kPoisson);
    }
    return at->second;
  };
  const auto stretch = [&bar](int n) { return bar(n).stretch; };
  const auto contraction = [&bar](int n) { return bar(n).contraction; };
  const auto tube = [](int n) { return LameTube(n, kPoisson); };
  run("uniaxial", stretch, 4, 4, stretch);
  run("poisson", contraction, 4, 4, contraction);
  run("hanging_sheet", HangingSheet, 16, 8, HangingSheet);
  run("lame_tube", tube, 1, 2, tube);  // One layer, as in the wall of the organ.
  // Beam theory does not include the clamp, so the order is measured in pure bending, for which the theory is exact.
  run(
      "cantilever", [](int n) { return Cantilever(n, kPoisson); }, 4, 4,
      [](int n) { return PureBending(n, kPoisson); });
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  fulcrum::physics::RunAll(&report);
}
