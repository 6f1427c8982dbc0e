// A grasper takes the membrane and lifts it by 10 mm.
#include <cstdio>

#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"

int main() {
  using namespace fulcrum;
  const scene::SceneData scene = scene::BuildProcedural(scene::Small());
  const SceneView view = scene.View();
  physics::TissueSimulation tissue(view);

  // The tool's axis points down; its tip begins on the middle of the membrane.
  const Index middle = view.membrane.first + view.membrane.rows / 2 * view.membrane.cols + view.membrane.cols / 2;
  const Vec3f place = view.rest_position[middle];
  std::array<physics::ToolInput, kMaxTools> tools;
  tools[0].present = true;
  tools[0].pose.q_WT = Quatf(0, 1, 0, 0);
  for (int step = 0; step < 300; ++step) {
    const float lift_m = 0.01f * static_cast<float>(std::clamp(step - 50, 0, 200)) / 200.0f;
    tools[0].pose.p_WT = place + Vec3f(0, 0, lift_m);
    tools[0].pose.jaw_rad = step < 30 ? 0.8f : 0.0f;
    tissue.Step(tools);
  }
  const float displaced_mm = 1e3f * tissue.MaxDisplacement();
  std::printf("%u particles, displaced by %.1f mm, state %016llx\n", tissue.particles().particle_count(),
              static_cast<double>(displaced_mm), static_cast<unsigned long long>(tissue.StateHash()));
  return displaced_mm > 5 && displaced_mm < 15 && tissue.quarantined() == 0 ? 0 : 1;
}
