// A round electrode of 0.5 mm cuts 8 mm along the membrane: 40 W at 4 mm/s.
#include <cstdio>

#include "services/scene/builder/build.h"
#include "thermal_node/coupling/thermal_solver.h"

int main() {
  using namespace fulcrum;
  const scene::SceneData scene = scene::BuildProcedural(scene::Small());
  const SceneView view = scene.View();
  thermal::ThermalSolver heat(view);

  const Index middle = view.membrane.rows / 2 * view.membrane.cols + view.membrane.cols / 2;
  const Vec2f begin = view.membrane_material[middle];
  constexpr float kFrame_s = 0.01f, kSpeed_m_s = 4e-3f;
  for (int frame = 0; frame < 200; ++frame) {
    thermal::TipInput tip{.active = true, .touching = true, .path = {}, .mode = CauteryMode::kCut, .power_W = 40};
    tip.path.radius_m = view.thermal.hook_radius_m;
    tip.path.from = begin + Vec2f(kSpeed_m_s * kFrame_s * static_cast<float>(frame), 0);
    tip.path.to = tip.path.from + Vec2f(kSpeed_m_s * kFrame_s, 0);
    tip.path.displacement = tip.path.to - tip.path.from;
    heat.Step(tip, kFrame_s);
  }
  const float cut_mm = 1e3f * heat.cut_length_m();
  std::printf("hottest %.0f C, cut %.1f mm\n", static_cast<double>(heat.figures().highest_C),
              static_cast<double>(cut_mm));
  return cut_mm > 6 && cut_mm < 10 ? 0 : 1;
}
