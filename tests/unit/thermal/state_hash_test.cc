// One committed state for every processor: the heat, the damage and the topology after a cut have the same bits on
// x86-64 and on AArch64. An intended change of the numerics changes it: the failed test then prints the value to be
// written here.
#include <gtest/gtest.h>

#include "services/scene/builder/build.h"
#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::thermal {
namespace {

TEST(ThermalStateHash, IsTheSameOnEveryProcessor) {
#if defined(__clang__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the committed state is that of a build by gcc";
#endif
  const scene::SceneData scene = scene::BuildProcedural(scene::Small());
  const SceneView view = scene.View();
  ThermalSolver solver(view);
  const Index middle = view.membrane.rows / 2 * view.membrane.cols + view.membrane.cols / 2;
  constexpr float kFrame_s = 0.01f, kSpeed_m_s = 4e-3f;
  TipInput tip{.active = true, .touching = true, .path = {}, .mode = CauteryMode::kCut, .power_W = 40};
  tip.path.radius_m = view.thermal.hook_radius_m;
  tip.path.to = view.membrane_material[middle];
  tip.path.displacement = Vec2f(kSpeed_m_s * kFrame_s, 0);
  for (int frame = 0; frame < 100; ++frame) {
    tip.path.from = tip.path.to;
    tip.path.to += tip.path.displacement;
    solver.Step(tip, kFrame_s);
  }
  EXPECT_GT(solver.cut_length_m(), 2e-3f) << "little was cut: the hash proves little";
  EXPECT_EQ(solver.FullHash(), 0xfba6907758df6537ull);
}

}  // namespace
}  // namespace fulcrum::thermal
