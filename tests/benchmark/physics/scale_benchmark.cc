// The accurate mode on scenes far beyond what a frame on the bus can hold: a flat sheet over a tube, at the density of
// the built-in scene, ten and fifty times as many particles, without bindings and hinges. A patch of the sheet is
// pulled up.
#include "tests/benchmark/physics/scaled_scene.h"
#include "tests/benchmark/report.h"
#include "tests/numerics/physics/accurate_under_test.h"

namespace fulcrum::physics {
namespace {

/// Median time of a frame [ms] in a pull.
double FrameMs(const SceneView& scene, int frames) {
  AccurateUnderTest solver(scene);
  std::vector<Index> held;
  std::vector<Vec3f> places;
  for (Index r = scene.membrane.rows / 2 - 7; r <= scene.membrane.rows / 2 + 7; ++r) {
    for (Index c = scene.membrane.cols / 2 - 2; c <= scene.membrane.cols / 2 + 2; ++c) {
      held.push_back(scene.membrane.first + r * scene.membrane.cols + c);
      places.push_back(scene.rest_position[held.back()]);
    }
  }
  solver.Hold(held);
  return benchmark::Quantile(benchmark::TimeMs(2, frames,
                                               [&] {
                                                 for (Vec3f& place : places) {
                                                   place.z() += 0.0006f;
                                                 }
                                                 solver.MoveHeld(places);
                                                 solver.Step();
                                               }),
                             0.5);
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  if (!report.Wants("physics.scale.")) {
    return 0;
  }
  double per_particle = 0;
  for (const int factor : {1, 10, 50}) {
    if (factor == 50 && report.quick()) {
      continue;
    }
    const fulcrum::scene::SceneData data = fulcrum::physics::MakeScaledScene(factor);
    const fulcrum::SceneView scene = data.View();
    const double ms = fulcrum::physics::FrameMs(scene, factor == 1 ? 40 : 12);
    const double each = ms / static_cast<double>(scene.rest_position.size());
    const std::string stem = "physics.scale.x" + std::to_string(factor) + ".";
    report.Add(stem + "particles", static_cast<double>(scene.rest_position.size()), "1");
    report.Add(stem + "frame_ms_p50", ms, "ms");
    if (factor == 1) {
      per_particle = each;
    } else {
      report.Add(stem + "ratio_per_particle", each / per_particle, "1");
    }
  }
}
