// Tools at places that no operator intends: deep in the organ, through it at full speed, across each other.
#include <gtest/gtest.h>

#include <utility>

#include "physics_node/collision/closest.h"
#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"

namespace fulcrum::physics {
namespace {

class DeepTools : public testing::TestWithParam<PhysicsMode> {
 protected:
  static scene::SceneData Scene() {
    scene::SceneData data = scene::BuildProcedural(scene::Small());
    data.fixed.physics.mode = GetParam();
    return data;
  }

  scene::SceneData data_ = Scene();
  SceneView scene_ = data_.View();
  TissueSimulation simulation_{scene_};
  std::array<ToolInput, kMaxTools> tools_;
  /// The membrane's middle, over the organ's top.
  const Vec3f middle_ = scene_.rest_position[scene_.membrane.first + 36 * 25 + 12];

  /// Shaft straight up, rotated about its axis.
  static ToolPose Upright(const Vec3f& tip, float jaw_rad, float about_z = 0) {
    return {tip,
            Quatf(Eigen::AngleAxisf(about_z, Vec3f::UnitZ())) *
                Quatf(Eigen::AngleAxisf(static_cast<float>(M_PI), Vec3f::UnitX())),
            jaw_rad};
  }

  void Step() {
    simulation_.Step(tools_);
    for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
      const DeviceContacts device = simulation_.Contacts(tool);
      for (std::uint32_t c = 0; c < device.count; ++c) {
        ASSERT_TRUE(device.contacts[c].f_ref.allFinite());
        ASSERT_LE(device.contacts[c].f_ref.norm(), 16.0f);
      }
    }
    ASSERT_TRUE(std::isfinite(simulation_.MaxDisplacement()));
  }
  /// Moves tool `i` to `pose` in so many steps.
  void Drive(std::size_t i, const ToolPose& pose, int steps) {
    const ToolPose from = tools_[i].present ? tools_[i].pose : pose;
    for (int s = 1; s <= steps; ++s) {
      tools_[i] = {true, Interpolate(from, pose, static_cast<float>(s) / static_cast<float>(steps))};
      Step();
    }
  }
  [[nodiscard]] Vec3f At(Index particle) const {
    return simulation_.particles().At(simulation_.particles().Ref(particle));
  }

  /// Free membrane nodes more than 1 mm inside the organ.
  [[nodiscard]] int MembraneInOrgan() const {
    int inside = 0;
    for (Index p = scene_.membrane.first; p < simulation_.particles().particle_count(); ++p) {
      float best = 1e9f;
      bool behind = false;
      for (const Triangle& t : scene_.tube_surface) {
        const Vec3f a = At(t[0]), b = At(t[1]), c = At(t[2]);
        const auto w = ClosestOnTriangle(At(p), a, b, c);
        const Vec3f offset = At(p) - w[0] * a - w[1] * b - w[2] * c;
        if (offset.squaredNorm() < best) {
          best = offset.squaredNorm();
          behind = (b - a).cross(c - a).dot(offset) < 0.0f;
        }
      }
      inside += behind && best > 1e-6f && scene_.inverse_mass[p] > 0.0f;
    }
    return inside;
  }
  [[nodiscard]] int Inverted() const {
    int inverted = 0;
    for (const Tetrahedron& t : scene_.tets) {
      inverted += (At(t[1]) - At(t[0])).cross(At(t[2]) - At(t[0])).dot(At(t[3]) - At(t[0])) <= 0.0f;
    }
    return inverted;
  }
  /// After the tools are removed: tissue near rest, no inverted tetrahedron, the membrane over the organ.
  void ExpectRecovery() {
    tools_ = {};
    for (int i = 0; i < 600; ++i) {
      Step();
    }
    EXPECT_LT(simulation_.MaxDisplacement(), 0.005f);
    EXPECT_EQ(Inverted(), 0);
    EXPECT_EQ(MembraneInOrgan(), 0);
  }
};

TEST_P(DeepTools, SteepJawsPushedIntoTheOrgan) {
  for (const float jaw : {0.9f, 0.3f, 0.0f}) {
    for (const float about_z : {0.0f, 1.1f}) {
      Drive(0, Upright(middle_ + Vec3f(0, 0, 0.015f), jaw, about_z), 1);
      Drive(0, Upright(middle_ - Vec3f(0, 0, 0.015f), jaw, about_z), 60);
      for (int i = 0; i < 100; ++i) {
        Step();
        ASSERT_LT(simulation_.MaxDisplacement(), 0.04f) << "jaw " << jaw << " turned " << about_z << " step " << i;
      }
      Drive(0, Upright(middle_ + Vec3f(0, 0, 0.03f), jaw, about_z), 60);
      ExpectRecovery();
    }
  }
}

TEST_P(DeepTools, ThroughTheOrganAtOneMetrePerSecond) {
  for (std::size_t tool = 0; tool < kMaxTools; ++tool) {
    Drive(tool, Upright(middle_ + Vec3f(0.001f, 0.002f, 0.025f), 0.0f), 1);
    Drive(tool, Upright(middle_ + Vec3f(0.001f, 0.002f, -0.025f), 0.0f), 5);
    for (int i = 0; i < 20; ++i) {
      Step();
      ASSERT_LT(simulation_.MaxDisplacement(), 0.06f);
    }
    Drive(tool, Upright(middle_ + Vec3f(0.001f, 0.002f, 0.035f), 0.0f), 6);
    ExpectRecovery();
  }
}

TEST_P(DeepTools, AcrossEachOther) {
  const auto left = [&](float x) { return Upright(middle_ + Vec3f(x, 0, -0.003f), 0.3f); };
  const auto right = [&](float x) { return Upright(middle_ + Vec3f(x, 0.001f, -0.004f), 0.0f, 0.5f); };
  tools_[0] = {true, left(-0.012f)};
  tools_[1] = {true, right(0.012f)};
  tools_[0].pose.p_WT.z() += 0.02f;
  tools_[1].pose.p_WT.z() += 0.02f;
  Step();
  Drive(0, left(-0.012f), 20);
  Drive(1, right(0.012f), 20);
  for (int i = 0; i <= 120; ++i) {
    const float x = 0.012f * std::cos(0.1f * static_cast<float>(i));
    tools_[0].pose = left(-x);
    tools_[1].pose = right(x);
    Step();
    ASSERT_LT(simulation_.MaxDisplacement(), 0.06f);
  }
  Drive(0, Upright(middle_ + Vec3f(-0.012f, 0, 0.03f), 0.3f), 30);
  Drive(1, Upright(middle_ + Vec3f(0.012f, 0, 0.03f), 0.0f), 30);
  ExpectRecovery();
}

/// Largest force on tool 0 of `scene`, if each `missed`-th period has no step; 0: none is missed.
float PeakForce(const SceneView& scene, int missed) {
  TissueSimulation simulation(scene);
  float peak = 0;
  std::uint64_t periods = 0;
  for (int i = 0; i < static_cast<int>(scene.script_duration_s / scene.physics.dt_s); ++i) {
    ++periods;
    if (missed > 0 && i % missed == missed - 1) {
      continue;
    }
    (void)simulation.Step(ScriptedTools(scene, static_cast<double>(scene.physics.dt_s) * i), std::exchange(periods, 0));
    const DeviceContacts device = simulation.Contacts(0);
    peak = std::max(peak, device.count > 0 ? device.contacts[0].f_ref.norm() : 0.0f);
  }
  return peak;
}

TEST(LateTools, TapsPressAsHardAsInStepsOfAMillisecond) {
  scene::SceneSettings settings = scene::BuiltIn();
  settings.script.clear();
  for (int i = 0; i < 9; ++i) {
    scene::ScriptKeySettings& key = settings.script.emplace_back();
    key.time_s = 0.25 * i;
    key.sheet = Vec2f(0.40f, 0.5f);
    key.height_m = i % 2 == 0 ? 0.002f : -0.003f;
    key.jaw_rad = 0.35f;
  }
  settings.script_duration_s = 2.0;
  const scene::SceneData data = scene::BuildProcedural(settings);
  SceneView exact = data.View();
  exact.physics.dt_s = 1e-3f;
  const float truth = PeakForce(exact, 0);
  ASSERT_GT(truth, 0.1f);
  for (const int missed : {0, 2, 3, 4}) {
    EXPECT_NEAR(PeakForce(data.View(), missed), truth, 0.06f * truth) << missed;
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, DeepTools, testing::Values(PhysicsMode::kPaper, PhysicsMode::kAccurate),
                         [](const auto& mode) {
                           return mode.param == PhysicsMode::kPaper ? std::string("paper") : std::string("accurate");
                         });

}  // namespace
}  // namespace fulcrum::physics
