// The shipped scenes under their scripts: a plausible tent, no instability, rest afterwards.
#include <gtest/gtest.h>

#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"

namespace fulcrum::physics {
namespace {

struct Played {
  float max_displacement = 0, max_tube = 0, end_displacement = 0, max_force = 0;
  int inverted = 0, cutting_steps = 0, cutting_contacts = 0;
  std::size_t most_held = 0, held_at_pull = 0;
  std::uint64_t quarantined = 0;
  bool asleep = false;
};

int CountInverted(const SceneView& scene, const ParticleStore& particles) {
  int inverted = 0;
  for (const Tetrahedron& t : scene.tets) {
    const auto x = [&](int i) { return particles.At({4 * t[static_cast<std::size_t>(i)], 1}); };
    inverted += (x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0)) <= 0.0f;
  }
  return inverted;
}

/// Plays the script and continues for `after_s`.
Played Play(const SceneView& scene, double after_s) {
  TissueSimulation simulation(scene);
  Played played;
  const int end = static_cast<int>((scene.script_duration_s + after_s) * 100);
  for (int i = 0; i < end; ++i) {
    const double time = 0.01 * i;
    played.asleep = simulation.Step(ScriptedTools(scene, time)).asleep;
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      (void)simulation.Contacts(tool);
      played.max_force = std::max(played.max_force, simulation.force(tool).norm());
    }
    const CauteryContact contact = simulation.Cautery(1);
    const ScriptPoint hook = EvaluateScript(scene.script, 1, time);
    if (hook.pedals != kPedalNone) {
      ++played.cutting_steps;
      played.cutting_contacts += contact.touching;
      played.held_at_pull = simulation.grasp(0).held().size();
    }
    played.most_held = std::max(played.most_held, simulation.grasp(0).held().size());
    if (i % 10 == 0) {
      played.inverted = std::max(played.inverted, CountInverted(scene, simulation.particles()));
      played.max_displacement = std::max(played.max_displacement, simulation.MaxDisplacement());
      for (Index v = 0; v < scene.tube_vertex_count; ++v) {
        played.max_tube =
            std::max(played.max_tube, (simulation.particles().At({4 * v, 1}) - scene.rest_position[v]).norm());
      }
    }
  }
  played.end_displacement = simulation.MaxDisplacement();
  played.quarantined = simulation.quarantined();
  return played;
}

void ExpectBelievable(const Played& played, float pull_m) {
  EXPECT_GT(played.max_displacement, 0.7f * pull_m);
  EXPECT_LT(played.max_displacement, 2.0f * pull_m);
  EXPECT_GT(played.max_tube, 0.05f * pull_m);  // The organ follows …
  EXPECT_LT(played.max_tube, 0.8f * pull_m);   // … moderately.
  EXPECT_EQ(played.inverted, 0);
  EXPECT_EQ(played.quarantined, 0u);
  EXPECT_GT(played.most_held, 10u);
  // The grasp holds during the script; where the traction reaches the grip force, its rim slips a little.
  EXPECT_GE(played.held_at_pull, played.most_held * 4 / 5);
  EXPECT_GT(played.cutting_contacts, played.cutting_steps * 8 / 10);
  EXPECT_GT(played.max_force, 0.5f);
  EXPECT_LT(played.max_force, 12.0f);
  EXPECT_LT(played.end_displacement, 0.005f);
}

TEST(Script, SmallSceneIsBelievable) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const Played played = Play(data.View(), 4.0);
  ExpectBelievable(played, 0.012f);
  EXPECT_LT(played.max_displacement, 0.060f);
}

TEST(Script, BuiltInSceneIsBelievable) {
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  const Played played = Play(data.View(), 5.0);
  ExpectBelievable(played, 0.025f);
  EXPECT_GT(played.max_displacement, 0.010f);
  EXPECT_LT(played.max_displacement, 0.060f);
  EXPECT_TRUE(played.asleep);  // Folds of the released membrane creep for some seconds.
}

}  // namespace
}  // namespace fulcrum::physics
