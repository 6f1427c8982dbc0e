// Tearing: the stretch at which a strip tears against the limit of the scene, and the spread between meshes.
#include <algorithm>
#include <cmath>

#include "physics_node/tear/tear_watch.h"
#include "services/scene/builder/build.h"
#include "tests/benchmark/report.h"
#include "tests/numerics/cut/strip_pull.h"

namespace fulcrum::cut {
namespace {

constexpr float kMeshes_m[] = {0.002f, 0.0013333f, 0.001f};

void RunStrips(benchmark::Report* report) {
  if (!report->Wants("tear.")) return;
  double error = 0, apart = 0, spread = 0, corner = 0;
  for (const bool guided : {true, false}) {
    double least = 1e9, most = 0;
    for (const float h_m : kMeshes_m) {
      const StripSettings settings{.h_m = h_m, .guided = guided};
      const StripResult result = PullStrip(settings);
      const double stretch = static_cast<double>(result.stretch), limit = static_cast<double>(settings.tear_stretch);
      least = std::min(least, stretch);
      most = std::max(most, stretch);
      if (guided) {
        error = std::max(error, std::abs(stretch / limit - 1));
      } else {
        apart = std::max(apart, result.apart_s < 0 ? HUGE_VAL : result.apart_s);
        corner = stretch;
      }
    }
    spread = std::max(spread, (most - least) / most);
  }
  report->Add("tear.stretch_error_pct", 100 * error, "%");
  report->Add("tear.mesh_spread_pct", 100 * spread, "%");
  report->Add("tear.clamped_strip_stretch", corner, "1");
  report->Add("tear.apart_s", apart, "s");
}

/// All nodes have moved, but none is near tearing.
void RunWatch(benchmark::Report* report) {
  if (!report->Wants("tear.look")) return;
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const SceneView scene = data.View();
  physics::ParticleStore particles(scene);
  const physics::TissueModel model(scene, &particles);
  physics::TearWatch watch(scene, &model, &particles);
  std::uint64_t step = 0;
  const auto times = benchmark::TimeMs(10, 200, [&] {
    watch.RowsMoved(0, scene.membrane.rows, 1e-6f);
    (void)watch.Evaluate(step += physics::TearWatch::kEveryAll);
  });
  report->Add("tear.look_all_us_p50", 1e3 * benchmark::Quantile(times, 0.5), "us");
}

}  // namespace
}  // namespace fulcrum::cut

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  fulcrum::cut::RunStrips(&report);
  fulcrum::cut::RunWatch(&report);
}
