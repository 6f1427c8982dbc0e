// The contact model that physics sends to the servo, entry by entry: of a pressed sheet, of a grasp, of a cylinder.
#include "physics_node/contact_model/contact_probe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "haptics_node/servo/contact_law.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "tests/support/flat_sheets.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

constexpr float kStep_s = 0.01f;

/// A tool that points down.
ToolInput Pointing(const Vec3f& tip, float jaw_rad) {
  return {true, {tip, Quatf(Eigen::AngleAxisf(std::numbers::pi_v<float>, Vec3f::UnitX())), jaw_rad}};
}

/// A sheet of 33 x 32 mm about the origin, with E t = 150 N/m.
scene::SceneData OneSheet() {
  constexpr double h = kFlatCell_m;
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.physics.dt_s = kStep_s;
  settings.physics.membrane_Et_N_per_m = 150;
  scene::Anatomy anatomy;
  anatomy.sheets.push_back(FlatSheet("sheet", 22, 22, Vec3d(-10.5 * h, -10.5 * h, 0), Vec3d(0, h, 0), Vec3d(h, 0, 0)));
  return scene::AssembleScene(settings, anatomy);
}

class ContactOfASheet : public testing::Test {
 protected:
  scene::SceneData data_ = OneSheet();
  SceneView scene_ = data_.View();
  TissueSimulation simulation_{scene_};

  /// Contact of a tool after `steps` of 10 mm/s along z to `end`.
  Contact Move(int tool, const Vec3f& end, float direction, float jaw_rad, int steps) {
    std::array<ToolInput, kMaxTools> tools{};
    DeviceContacts device;
    for (int i = steps - 1; i >= 0; --i) {
      const Vec3f tip = end - Vec3f(0, 0, direction * 0.01f * kStep_s * static_cast<float>(i));
      tools[static_cast<std::size_t>(tool)] = Pointing(tip, jaw_rad);
      simulation_.Step(tools);
      device = simulation_.Contacts(static_cast<std::uint32_t>(tool));
    }
    EXPECT_EQ(device.count, 1u);
    return device.contacts[0];
  }
};

/// A disc of the sheet resists with 2 E t, sideways with half of that; friction is the scene's, 0.2. The tissue follows
/// the tip of 10 mm/s inwards.
TEST_F(ContactOfASheet, PressedHasTheSkinAndFrictionOfTheSheet) {
  const Contact contact = Move(1, Vec3f(0, 0, -0.003f), -1, 0, 60);
  ASSERT_EQ(contact.kind, ContactKind::kSurface);
  EXPECT_NEAR(contact.k1, 300, 0.1f);
  EXPECT_NEAR(contact.kt, 150, 0.1f);
  EXPECT_NEAR(contact.friction, 0.2f, 1e-6f);
  EXPECT_NEAR(contact.radius, 0.012f, 1e-6f);
  EXPECT_GT(contact.n.z(), 0.99f);
  EXPECT_NEAR(contact.du_c.dot(contact.n), -0.01f, 5e-4f);
}

/// A tip moved sideways is drawn back by the skin and the body in series.
TEST_F(ContactOfASheet, ResistsASidewaysTipInTheServo) {
  Contact contact = Move(1, Vec3f(0, 0, -0.003f), -1, 0, 60);
  contact.b_body = 0;  // at rest
  contact.du_c.setZero();
  constexpr double kAside_m = 2e-4;
  const Vec3d along = contact.n.cast<double>().unitOrthogonal();
  const auto felt = [&](double aside) {
    haptics::ContactState state;
    const haptics::ContactLaw law = haptics::MakeContactLaw(contact, 0, &state);
    return haptics::StepContact(law, contact.x_ref.cast<double>() + aside * along, 0, 1e-3, &state).f_W;
  };
  const double expected = -kAside_m / (1 / 150.0 + 1 / static_cast<double>(contact.k_body));
  ASSERT_LT(-expected, 0.2 * 0.5 * static_cast<double>(contact.f_ref.norm())) << "sticks";
  EXPECT_NEAR((felt(kAside_m) - felt(0)).dot(along), expected, 0.05 * -expected);
}

/// Jaws at 0.1 rad hold 8 N (1 - 0.1 / 0.45); no skin yields between them, and what they hold moves with them.
TEST_F(ContactOfASheet, HeldSlipsAtTheGripOfItsJaws) {
  (void)Move(0, Vec3f(0, 0, -0.001f), -1, 0.8f, 40);
  const Contact contact = Move(0, Vec3f(0, 0, 0.003f), 1, 0.1f, 40);
  ASSERT_EQ(contact.kind, ContactKind::kGrasp);
  EXPECT_NEAR(contact.slip_force, 8 * (1 - 0.1 / 0.45), 0.01);
  EXPECT_NEAR(contact.k1, 1e4f, 1);
  EXPECT_LT((contact.du_c - Vec3f(0, 0, 0.01f)).norm(), 5e-4f) << contact.du_c.transpose();
  EXPECT_NEAR(contact.radius, 0.03f, 1e-6f);
  EXPECT_LT(contact.f_ref.z(), -0.05f);
}

/// Across a cylinder of 20 mm radius the middle of the tip rolls on a circle of that radius, its own and the margin;
/// along it on a line.
TEST(ContactOfACylinder, HasItsCurvatureAcrossIt) {
  constexpr double kRadius_m = 0.02, kArc = kFlatCell_m / kRadius_m;
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.physics.dt_s = kStep_s;
  settings.physics.membrane_prestrain = 0;
  scene::Anatomy anatomy;
  anatomy.sheets.push_back(FlatSheet("roof", 25, 21, Vec3d::Zero(), Vec3d(0, kFlatCell_m, 0), Vec3d(1, 0, 0)));
  for (Vec3d& node : anatomy.sheets[0].nodes) {
    const double angle = kArc * (node.x() - 10);
    node = Vec3d(kRadius_m * std::sin(angle), node.y() - 12 * kFlatCell_m, kRadius_m * std::cos(angle));
  }
  const scene::SceneData data = scene::AssembleScene(settings, anatomy);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  std::array<ToolInput, kMaxTools> tools{};
  DeviceContacts device;
  for (int i = 0; i < 60; ++i) {
    tools[0] = Pointing(Vec3f(0, 0, static_cast<float>(kRadius_m) + 0.004f - 1e-4f * static_cast<float>(i)), 0.35f);
    simulation.Step(tools);
    device = simulation.Contacts(0);
  }
  ASSERT_EQ(device.count, 1u);
  const Contact& contact = device.contacts[0];
  ASSERT_EQ(contact.gap, 0.0f) << "in contact";
  const double expected = 1 / (kRadius_m + static_cast<double>(scene.tools[0].tip_radius_m) +
                               static_cast<double>(ContactMargin(scene, ToolPart::kJaw)));
  EXPECT_NEAR(contact.kappa1, expected, 0.05 * expected);
  EXPECT_NEAR(contact.kappa2, 0, 0.05 * expected);
  EXPECT_LT(std::abs(contact.e1.y()), 0.05f) << "along the cylinder there is the small one";
}

/// Tissue that is a Kelvin-Voigt element of 200 N/m and 4 N s/m in every direction.
class Element : public ComplianceSolver {
 public:
  bool Stiffness(const Probe& /*probe*/, float horizon_s, float* newton_per_m) override {
    const float part = horizon_s > 0.0f ? 1.0f - std::exp(-200.0f * horizon_s / 4.0f) : 1.0f;
    *newton_per_m = 200.0f / part;
    return true;
  }
};

TEST(ContactOfAnElement, HasItsStiffnessAndViscosity) {
  scene::SceneData data = SheetScene(25, 25, 0.002f);
  data.fixed.physics.dt_s = kStep_s;
  const SceneView scene = data.View();
  ParticleStore particles(scene);
  const TissueModel model(scene, &particles);
  ToolCollision collision(scene, &model, &particles);
  ContactProbe probe(scene, &model, &particles);
  Element element;
  probe.SetComplianceSolver(&element);
  const auto pose = [](float height) { return Pointing(Vec3f(0.024f, 0.024f, height), 0).pose; };
  std::array<ToolCollision::ToolMotion, kMaxTools> motion;
  motion[1] = {ShapeOf(scene.tools[1], pose(0.001f)), ShapeOf(scene.tools[1], pose(-0.0003f))};
  collision.FindPairs(motion, true);
  collision.Sweep();
  collision.Project();
  ASSERT_TRUE(collision.any_touching());
  const ToolForce force{Vec3f(0, 0, 0.1f), pose(-0.0003f).p_WT};
  DeviceContacts device;
  for (int i = 0; i < 4; ++i) device = probe.Update(1, pose(-0.0003f), collision, Grasp(scene), kStep_s, &force);
  ASSERT_EQ(device.count, 1u);
  EXPECT_NEAR(device.contacts[0].k_body, 200, 0.5f);
  EXPECT_NEAR(device.contacts[0].b_body, 4, 0.05f);
}

}  // namespace
}  // namespace fulcrum::physics
