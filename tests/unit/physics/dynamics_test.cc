// Figures that follow from mechanics, not from the code's own constants: gravity, damping, weight, bending.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

/// A sheet without tools, after some time.
struct Fall {
  TissueSimulation simulation;
  explicit Fall(const SceneView& scene, double seconds) : simulation(scene) {
    const std::array<ToolInput, kMaxTools> no_tools{};
    const auto steps = std::lround(seconds / static_cast<double>(scene.physics.dt_s));
    for (long i = 0; i < steps; ++i) (void)simulation.Step(no_tools);
  }
  [[nodiscard]] double z(Index particle) const {
    return static_cast<double>(simulation.particles().At(simulation.particles().Ref(particle)).z());
  }
};

class Falling : public testing::TestWithParam<PhysicsMode> {};

/// Nothing holds the sheet: g / c (t - (1 - exp(-c t)) / c), whatever it is made of.
TEST_P(Falling, AFreeSheetFallsAndIsDamped) {
  constexpr Index kRows = 9;
  scene::SceneData data = SheetScene(kRows, kRows);
  for (float& inverse_mass : data.inverse_mass) inverse_mass = 1.0f / (0.5f * 0.002f * 0.002f);
  SceneView scene = data.View();
  scene.physics.mode = GetParam();
  for (const double c : {2.0, 8.0}) {
    constexpr double kG = 1, kTime_s = 0.2;
    scene.physics.gravity = Vec3f(0, 0, -static_cast<float>(kG));
    scene.physics.damping_per_s = static_cast<float>(c);
    const Fall fall(scene, kTime_s);
    const double expected = -kG / c * (kTime_s - (1 - std::exp(-c * kTime_s)) / c);
    for (const Index particle : {Index{0}, kRows * kRows / 2, kRows * kRows - 1}) {
      EXPECT_NEAR(fall.z(particle) / expected, 1, 0.08) << "damping " << c << " 1/s, particle " << particle;
    }
  }
}

/// A late step simulates several periods at once, with longer substeps; velocities stay.
TEST(FallingInXpbd, LateStepsKeepTheSpeed) {
  constexpr Index kRows = 9;
  scene::SceneData data = SheetScene(kRows, kRows);
  for (float& inverse_mass : data.inverse_mass) inverse_mass = 1.0f / (0.5f * 0.002f * 0.002f);
  SceneView scene = data.View();
  scene.physics.mode = PhysicsMode::kXpbd;
  scene.physics.damping_per_s = 0;
  constexpr double kG = 1;
  scene.physics.gravity = Vec3f(0, 0, -static_cast<float>(kG));
  TissueSimulation simulation(scene);
  const ParticleRef middle = simulation.particles().Ref(kRows * kRows / 2);
  double before = 0, time_s = 0;
  for (const std::uint64_t periods : {1, 1, 1, 1, 3, 1, 2, 3, 3, 1, 1}) {
    (void)simulation.Step({}, periods);
    const double z = static_cast<double>(simulation.particles().At(middle).z()),
                 step_s = static_cast<double>(periods) * static_cast<double>(scene.physics.dt_s);
    const double mean_time_s = time_s + 0.5 * step_s;
    EXPECT_NEAR((before - z) / step_s, kG * mean_time_s, 0.08 * kG * mean_time_s) << "at " << time_s << " s";
    before = z;
    time_s += step_s;
  }
}

/// The velocity of the surroundings in a contact model is that of the tissue, here carried by another tool.
TEST(SurroundingsInXpbd, MoveAtTheSpeedOfTheTissue) {
  constexpr float kSpeed_m_s = 0.02f;
  const scene::SceneData data = SheetScene(33, 33);
  SceneView scene = data.View();
  scene.physics.mode = PhysicsMode::kXpbd;
  scene.physics.grasp_radius_m = 0.02f;  // more than the ring of nodes around a contact
  scene.physics.grip_force_N = 1e3f;
  TissueSimulation simulation(scene);
  std::array<ToolInput, kMaxTools> tools{};
  DeviceContacts device;
  for (int i = 0; i < 40; ++i) {
    const float lift = kSpeed_m_s * scene.physics.dt_s * static_cast<float>(std::max(i - 5, 0));
    const Vec3f middle(0.032f, 0.032f, lift);
    tools[0] = {true, {middle, Quatf(0, 1, 0, 0), i < 2 ? 0.8f : 0.0f}};
    tools[1] = {true, {middle + Vec3f(0, 0, 0.005f), Quatf(0, 1, 0, 0), 0}};
    (void)simulation.Step(tools);
    device = simulation.Contacts(1);
  }
  ASSERT_TRUE(simulation.grasp(0).holding());
  ASSERT_EQ(device.count, 1u);
  EXPECT_NEAR(device.contacts[0].v_s.z(), kSpeed_m_s, 0.05f * kSpeed_m_s);
}

// Not mode accurate, which is made for tissue that something holds (physics_node/DESIGN.md, Limits).
INSTANTIATE_TEST_SUITE_P(Modes, Falling, testing::Values(PhysicsMode::kPaper, PhysicsMode::kXpbd));

/// A square membrane of the side 2 a that is held at its rim sags in the middle by w under its weight q per area:
/// q = C E t w^3 / a^4, C = 1.994 (1 - 0.271 nu) / (1 - nu) (Maier-Schneider, Maibach and Obermeier 1995).
TEST(Sagging, AHeldSheetSagsByItsWeight) {
  constexpr Index kRows = 25;
  constexpr double kHalf_m = 0.024, kG = 3.2, kWeight_Pa = 0.5 * kG, kPoisson = 0.5, kEt = 20;
  const scene::SceneData data = SheetScene(kRows, kRows);
  SceneView scene = data.View();
  scene.physics.mode = PhysicsMode::kAccurate;
  scene.physics.gravity = Vec3f(0, 0, -static_cast<float>(kG));
  scene.physics.membrane_Et_N_per_m = kEt;
  scene.physics.membrane_stiffening = 0;
  scene.physics.membrane_prestrain = 0;
  scene.physics.damping_per_s = 10;
  const Fall fall(scene, 3);
  const double shape = 1.994 * (1 - 0.271 * kPoisson) / (1 - kPoisson);
  const double expected = -std::cbrt(kWeight_Pa * std::pow(kHalf_m, 4) / (shape * kEt));
  EXPECT_NEAR(fall.z(kRows * kRows / 2) / expected, 1, 0.03);
}

/// A fold of the angle t over an edge of length e between triangles of areas A0 and A1 costs 3/2 B e^2 t^2 / (A0 + A1)
/// (Bergou et al. 2006): two triangles of a grid of 2 mm with a corner lifted by 0.1 mm, B = 2e-6 Nm.
TEST(Bending, AFoldCostsItsEnergy) {
  const scene::SceneData data = SheetScene(9, 9, 0.002f);
  SceneView scene = data.View();
  scene.physics.membrane_bending_Nm = 2e-6f;
  const ElasticModel model = BuildElasticModel(scene);
  ASSERT_FALSE(model.hinges.empty());
  for (const ElasticHinge& hinge : model.hinges) {
    const double lift = hinge.c[3] * 1e-4;
    EXPECT_NEAR(0.5 * hinge.stiffness * lift * lift, 3e-8, 1e-10) << "J";
  }
}

}  // namespace
}  // namespace fulcrum::physics
