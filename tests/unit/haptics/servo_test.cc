// The whole servo in simulated time: forces on a wall, stalls, absurd messages, determinism.
#include "haptics_node/servo/servo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "haptics_node/device/simulated_device.h"
#include "services/base/core/error.h"
#include "services/base/core/scope.h"
#include "tests/unit/haptics/loop.h"
#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics {
namespace {

using testing::BenchScene;
using testing::BenchTrocar;
using testing::GuidedDevice;
using testing::kIntoTheWall;
using testing::kNothing;
using testing::LatePhysics;
using testing::Loop;
using testing::SentForce;
using testing::TestTissue;
using testing::TickAt;
using testing::TissueParameters;
using testing::UnrestAtTheWall;

/// A model of one surface across z, of a tool sample at `then`: `gap` beneath the tip in the origin, or touched with a
/// normal force.
ContactModel SurfaceModel(std::uint64_t sequence, const Tick& then, float gap, float force_N) {
  ContactModel model;
  model.stamp = {sequence + 1, 1, then.stamp_ns};
  model.tool_stamp_ns = then.stamp_ns;
  model.devices[0].count = 1;
  Contact& contact = model.devices[0].contacts[0];
  contact.kind = ContactKind::kSurface;
  contact.id = 1;
  contact.k1 = 500;
  contact.k_body = 1000;
  contact.b_body = 5;
  contact.gap = gap;
  contact.p_s.z() = -gap;
  contact.f_ref.z() = force_N;
  contact.u_c.z() = -force_N / contact.k_body;
  return model;
}

TEST(Servo, RefusesAShaftTooShortToTurnAbout) {
  SceneView scene = BenchScene(1);
  scene.tools[0].shaft_length_m = 0.02f;
  GuidedDevice device(BenchTrocar(), [](double) { return Vec3d(0, 0, 0.01); });
  EXPECT_THROW(Servo(ServoSettingsOf(scene), {&device, nullptr}), InputError);
}

TEST(Servo, WithoutModelsThereIsNoForceAndTheToolIsPublished) {
  GuidedDevice device(BenchTrocar(), [](double t) { return Vec3d(0, 0, 0.05 - 0.01 * t); });
  Loop loop(BenchScene(1), &device, {});
  loop.physics.stalled = true;
  loop.Run(200, [&](const Tick&) { EXPECT_EQ(device.force, Vec3d::Zero()); });
  const ToolSample& tool = loop.servo.record().tool.tools[0];
  EXPECT_EQ(tool.kind, ToolKind::kGrasper);
  EXPECT_EQ(tool.state, ServoState::kOff);
  EXPECT_NEAR(tool.p_WT.z(), 0.05 - 0.01 * 0.199, 1e-6);
  EXPECT_NEAR(tool.v_WT.z(), -0.01, 1e-4);
  EXPECT_LT((tool.q_WT * Vec3f::UnitZ() + Vec3f::UnitZ()).norm(), 1e-6);  // z of the tool points down its shaft.
  EXPECT_EQ(tool.model_age_s, 0.0f);                                      // The gate of the bus refuses negative ages.
  EXPECT_LT(loop.servo.figures().model_age_s, 0.0);
  EXPECT_EQ(loop.servo.record().tool.tools[1].kind, ToolKind::kNone);
}

TEST(Servo, AScopeIsLevelUntilItIsTurned) {
  class Turned final : public HapticDevice {
   public:
    [[nodiscard]] Vec3d ReadPosition(const Tick& tick) noexcept override {
      return AttachPointForTip(BenchTrocar(), Vec3d(0.03 * tick.session_time_s, 0.02, 0.05));
    }
    void WriteForce(const Vec3d& f_W) noexcept override { (void)f_W; }
    [[nodiscard]] float ReadRoll() const noexcept override { return roll; }
    [[nodiscard]] std::uint8_t ReadButtons() const noexcept override { return 2; }
    float roll = 0;
  } device;
  SceneView scene = BenchScene(1);
  scene.tools[0].kind = ToolKind::kScope;
  scene.render.scope_tip_W = {0, -0.01f, 0.1f};  // Nearly vertical: level is cranial.
  Servo servo(ServoSettingsOf(scene), {&device});
  for (std::uint64_t i = 0; i < 1000; ++i) {
    servo.Step(TickAt(i));
    EXPECT_NEAR(RollOf(SightOf(servo.record().tool.tools[0].q_WT, 0), Vec3f::UnitY()), 0, 1e-4f) << i;
  }
  device.roll = 0.3f;
  servo.Step(TickAt(1000));
  EXPECT_NEAR(RollOf(SightOf(servo.record().tool.tools[0].q_WT, 0), Vec3f::UnitY()), -0.3f, 1e-4f);
  EXPECT_EQ(servo.record().tool.tools[0].buttons, 2);
  device.roll = std::numeric_limits<float>::quiet_NaN();
  servo.Step(TickAt(1001));
  EXPECT_NEAR(RollOf(SightOf(servo.record().tool.tools[0].q_WT, 0), Vec3f::UnitY()), -0.3f, 1e-4f)
      << "the last valid one";
}

TEST(Servo, PressingAPlaneGivesItsSeriesStiffnessStraightOut) {
  TissueParameters parameters;
  parameters.k3 = 0;
  GuidedDevice device(BenchTrocar(), [](double) { return Vec3d(0, 0, -0.004); });
  Loop loop(BenchScene(0.5), &device, parameters);
  loop.Run(1500, kNothing);
  const double expected = 0.5 * 0.004 / (1 / parameters.k1 + 1 / parameters.k_body);
  EXPECT_NEAR(SentForce(loop.servo).z(), expected, 0.002 * expected);
  EXPECT_LT(SentForce(loop.servo).head<2>().norm(), 1e-4);
  EXPECT_NEAR(device.force.z(), expected, 0.002 * expected);  // The lever is 1 here and the shaft is the normal.
}

TEST(Servo, PressTheShaftSidewaysAndTheHandFeelsTheFulcrum) {
  // A wall x > 0.05 … touched by a shaft that hangs straight down: the tip presses towards -x, so the wall pushes
  // towards +x. The hand, on the other side of the pivot, is pushed towards -x, scaled by the inside part over the
  // outside part.
  GuidedDevice device(BenchTrocar(), [](double) { return Vec3d(0, 0, -0.05); });
  Servo servo(ServoSettingsOf(BenchScene(0.3)),
              {&device, nullptr});  // Below the limit of the coupling: tip and proxy are equal.
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const Tick tick = TickAt(i);
    if (i % 10 == 0) {
      ContactModel model;
      model.stamp = {i + 1, 1, tick.stamp_ns};
      model.tool_stamp_ns = tick.stamp_ns;
      model.devices[0].count = 1;
      Contact& contact = model.devices[0].contacts[0];
      contact = TestTissue({}).Report();
      contact.n = Vec3f::UnitX();
      contact.e1 = Vec3f::UnitY();
      contact.x_ref = Vec3f(0, 0, -0.05f);
      contact.f_ref = Vec3f(1, 0, 0);
      contact.u_c = Vec3f(-1.0f / contact.k_body, 0, 0);
      servo.OfferModel(model, tick.stamp_ns);
    }
    servo.Step(tick);
  }
  EXPECT_NEAR(SentForce(servo).x(), 0.3, 1e-3);
  EXPECT_NEAR(device.force.x(), -0.3 * 0.25 / 0.15, 1e-3);
}

// The hand's spring against the tissue, with a known equilibrium.
TEST(Servo, HandSettlesInBalanceWithTheTissue) {
  const std::array<ScriptKey, 2> script{
      {{0.0f, 0, Vec3f(0, 0, 0.01f), 0, 0, 0}, {1.0f, 0, Vec3f(0, 0, -0.005f), 0, 0, 0}}};
  SceneView scene = BenchScene(0.3);
  scene.script = script;
  TissueParameters parameters;
  parameters.k3 = 0;
  SimulatedDevice device(scene.haptics, BenchTrocar(), script, 0);
  Loop loop(scene, &device, parameters);
  loop.Run(4000, kNothing);
  const double tissue = 0.3 / (1 / parameters.k1 + 1 / parameters.k_body);
  const double hand = scene.haptics.hand_stiffness_N_m;
  const double depth = 0.005 * hand / (hand + tissue);
  EXPECT_NEAR(loop.servo.record().tool.tools[0].p_WT.z(), -depth, 0.01 * depth);
  EXPECT_NEAR(SentForce(loop.servo).z(), tissue * depth, 0.01 * tissue * depth);
  EXPECT_LT(loop.servo.record().tool.tools[0].v_WT.norm(), 1e-4);
}

// A light grip hits a wall far stiffer than the servo may render: the oscillation decays.
TEST(Servo, AStiffWallStaysStable) {
  SceneView scene = BenchScene(1.0);
  scene.script = kIntoTheWall;
  SimulatedDevice device(scene.haptics, BenchTrocar(), scene.script, 0);
  Loop loop(scene, &device, {.k1 = 8000, .k3 = 0, .kt = 500, .k_body = 6000, .b_body = 3});
  const auto height = [&](const Tick&) -> double { return loop.servo.record().tool.tools[0].p_WT.z(); };
  EXPECT_LT(UnrestAtTheWall(&loop, height), 5e-5);
  EXPECT_GT(SentForce(loop.servo).z(), 0.5);
}

TEST(Servo, ProxyStandsOutOfAWallStifferThanTheCap) {
  GuidedDevice device(BenchTrocar(), [](double) { return Vec3d(0, 0, -0.002); });
  Loop loop(BenchScene(1.0), &device, {.k1 = 8000, .k3 = 0, .kt = 500, .k_body = 20000, .b_body = 3});
  loop.Run(1500, kNothing);
  const double z = loop.servo.record().tool.tools[0].p_WT.z();
  EXPECT_GT(z, -0.002 + 0.001);
  EXPECT_LT(z, 0);
  EXPECT_LT(SentForce(loop.servo).z(), 0.002 * kMaxHandStiffness_N_m);
}

/// A device at a given position.
class PlacedDevice final : public HapticDevice {
 public:
  [[nodiscard]] Vec3d ReadPosition(const Tick& /*tick*/) noexcept override { return p_WA; }
  void WriteForce(const Vec3d& f_W) noexcept override { force = f_W; }
  Vec3d p_WA = Vec3d::Zero(), force = Vec3d::Zero();
};

// The stiffest possible wall, with levers of 0.5 to 3 and from all sides: the stiffness at the hand is at most the cap.
TEST(Servo, CouplingIsCappedWhereTheHandFeelsIt) {
  const Vec3f pivots[] = {{0, 0, 0.2f}, {0, 0, 0.3f}, {0.13f, 0, 0.02f}, {0.27f, 0, 0.03f}, {0.1f, 0.1f, 0.15f}};
  for (const Vec3f& pivot : pivots) {
    SceneView scene = BenchScene(1.0);
    scene.tools[0].p_WP = pivot;
    const Trocar trocar{pivot.cast<double>(), scene.tools[0].shaft_length_m};
    const Vec3d place = AttachPointForTip(trocar, Vec3d(0, 0, -0.001));
    for (int axis = 0; axis < 3; ++axis) {
      PlacedDevice device;
      device.p_WA = place;
      Loop loop(scene, &device, {.k1 = 2e4, .k3 = 0, .kt = 2e4, .k_body = 2e5, .b_body = 20, .friction = 2});
      loop.Run(1200, kNothing);
      const Vec3d before = device.force;
      ASSERT_GT(before.norm(), 0.1);
      constexpr double kStep_m = 1e-4;
      device.p_WA += kStep_m * Vec3d::Unit(axis);
      loop.Run(400, kNothing);
      EXPECT_LE((device.force - before).norm(), 1.01 * kStep_m * kMaxHandStiffness_N_m)
          << "axis " << axis << ", pivot " << pivot.transpose();
    }
  }
}

TEST(Servo, TwoToolsPressTheirOwnTissue) {
  SceneView scene = BenchScene(0.5);
  scene.tools[1] = scene.tools[0];
  GuidedDevice left(BenchTrocar(), [](double) { return Vec3d(0, 0, -0.004); });
  GuidedDevice right(BenchTrocar(), [](double t) { return Vec3d(0, 0, 0.004 - 0.004 * t); });
  Servo servo(ServoSettingsOf(scene), {&left, &right});
  TestTissue soft({}), stiff({.k1 = 900, .k_body = 900, .b_body = 10});
  std::uint64_t sequence = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const Tick tick = TickAt(i);
    if (i % 10 == 0 && i > 0) {
      ContactModel model;
      model.stamp = {++sequence, 1, tick.stamp_ns};
      model.tool_stamp_ns = TickAt(i - 1).stamp_ns;
      model.devices[0].count = model.devices[1].count = 1;
      model.devices[0].contacts[0] = soft.Report();
      model.devices[1].contacts[0] = stiff.Report();
      servo.OfferModel(model, tick.stamp_ns);
    }
    servo.Step(tick);
    soft.Step(servo.record().tool.tools[0].p_WT.cast<double>(), tick.dt_s);
    stiff.Step(servo.record().tool.tools[1].p_WT.cast<double>(), tick.dt_s);
  }
  for (const auto& [device, tissue] : {std::pair{&left, &soft}, std::pair{&right, &stiff}}) {
    const double expected = 0.5 * tissue->force().z();
    EXPECT_GT(expected, 0.3);
    EXPECT_NEAR(device->force.z(), expected, 0.01 * expected);
  }
  EXPECT_GT((left.force - right.force).norm(), 0.1);
}

TEST(Servo, StallOfPhysicsFadesForcesAndBringsThemBackSoftly) {
  GuidedDevice device(BenchTrocar(), [](double) { return Vec3d(0, 0, -0.008); });
  Loop loop(BenchScene(1), &device, {});
  loop.Run(1500, kNothing);
  const double pressed = device.force.norm();
  ASSERT_GT(pressed, 1.5);
  EXPECT_EQ(loop.servo.figures().state, ServoState::kNormal);

  loop.physics.stalled = true;
  std::vector<double> forces;
  loop.Run(1000, [&](const Tick&) { forces.push_back(device.force.norm()); });
  EXPECT_LE(forces[400], 0.1);  // 400 ms after the last model.
  EXPECT_EQ(forces.back(), 0.0);
  EXPECT_EQ(loop.servo.figures().state, ServoState::kOff);

  loop.physics.stalled = false;
  forces.clear();
  loop.Run(1000, [&](const Tick&) { forces.push_back(device.force.norm()); });
  for (std::size_t i = 5; i < forces.size(); ++i) EXPECT_LE(forces[i] - forces[i - 5], 0.1 + 1e-9) << i;
  EXPECT_NEAR(forces.back(), pressed, 0.02 * pressed);
  EXPECT_EQ(loop.servo.figures().state, ServoState::kNormal);
}

// Models that are 40 to 100 ms old damp the hand: kHoldDamping (DESIGN.md) against the hand's own motion. Through its
// pivot a tip that goes to +x takes the hand to -x, at equal speed where the lever is 1.
TEST(Servo, OldModelsDampTheHand) {
  constexpr double kSpeed_m_s = 0.05;
  GuidedDevice device(BenchTrocar(), [](double t) { return Vec3d(kSpeed_m_s * (t - 0.8), 0, 0); });
  Servo servo(ServoSettingsOf(BenchScene(1)), {&device, nullptr});
  for (std::uint64_t i = 0; i <= 800; ++i) {
    const Tick tick = TickAt(i);
    if (i % 10 == 0 && i > 70) servo.OfferModel(SurfaceModel(i, TickAt(i - 60), 0.05f, 0), tick.stamp_ns);
    servo.Step(tick);
  }
  EXPECT_EQ(servo.figures().state, ServoState::kHold);
  EXPECT_NEAR(device.force.x(), kHoldDamping_Ns_m * kSpeed_m_s, 0.02 * kHoldDamping_Ns_m * kSpeed_m_s);
  EXPECT_LT(device.force.tail<2>().norm(), 1e-3);
}

// Tissue that carries the hand with 1 N and 10 mm/s gives it 10 mW. As physics declares this power, the hand feels all
// of the force; undeclared it is damped as much as the passivity controller may.
TEST(Servo, TissueThatMovesTheHandIsNotDampedAway) {
  constexpr double kSpeed_m_s = 0.01;
  const auto height = [](double t) { return -0.006 + kSpeed_m_s * std::max(0.0, t - 1.0); };
  const auto felt = [&](float declared_W) {
    GuidedDevice device(BenchTrocar(), [&](double t) { return Vec3d(0, 0, height(t)); });
    Servo servo(ServoSettingsOf(BenchScene(1)), {&device, nullptr});
    for (std::uint64_t i = 0; i < 1400; ++i) {
      const Tick tick = TickAt(i);
      if (i % 10 == 0) {
        ContactModel model = SurfaceModel(i, TickAt(i), 0, 1);
        model.devices[0].contacts[0].x_ref.z() = static_cast<float>(height(tick.session_time_s));
        model.devices[0].p_ext_W = declared_W;
        servo.OfferModel(model, tick.stamp_ns);
      }
      servo.Step(tick);
    }
    return device.force.z();
  };
  const double declared = felt(0.02f);
  EXPECT_GT(declared, 0.95);
  EXPECT_NEAR(declared - felt(0), kMaxPassivityDamping_Ns_m * kSpeed_m_s, 0.1 * kMaxPassivityDamping_Ns_m * kSpeed_m_s);
}

// A tip 200 mm beneath its pivot that moves at 20 mm/s turns its tool at 0.1 rad/s: v = w x r.
TEST(Servo, PublishesHowFastATurningToolTurns) {
  GuidedDevice device(BenchTrocar(), [](double t) { return Vec3d(0.02 * (t - 0.2), 0, 0); });
  Servo servo(ServoSettingsOf(BenchScene(1)), {&device, nullptr});
  for (std::uint64_t i = 0; i <= 200; ++i) servo.Step(TickAt(i));
  const Vec3f w = servo.record().tool.tools[0].w_WT;
  EXPECT_LT((w - Vec3f(0, -0.1f, 0)).norm(), 1e-3f) << w.transpose();
}

TEST(Servo, RestartOfPhysicsIsTakenUp) {
  GuidedDevice device(BenchTrocar(), [](double) { return Vec3d(0, 0, -0.004); });
  Loop loop(BenchScene(1), &device, {});
  loop.Run(1000, kNothing);
  const double pressed = device.force.norm();
  loop.physics.stalled = true;
  loop.Run(600, kNothing);
  loop.physics = LatePhysics();
  loop.physics.epoch = 2;
  loop.Run(800, kNothing);
  EXPECT_NEAR(device.force.norm(), pressed, 0.02 * pressed);
  EXPECT_EQ(loop.servo.figures().models_dropped, 0u);
}

// A tenth of all fields are random: for messages that pass the gate the force keeps its limits.
TEST(Servo, AbsurdModelsNeverBreakLimitOrSlew) {
  std::mt19937_64 random(3);
  std::normal_distribution<float> normal;
  std::uniform_int_distribution<int> die(0, 99);
  const auto wild = [&](float good) -> float {
    switch (die(random)) {
      case 0:
        return std::numeric_limits<float>::quiet_NaN();
      case 1:
        return -std::numeric_limits<float>::infinity();
      case 2:
        return 1e30f * normal(random);
      case 3:
      case 4:
      case 5:
        return good * std::pow(10.0f, 3 * normal(random));
      case 6:
        return -good;
      default:
        return good;
    }
  };
  Vec3d tip(0, 0, 0.01);
  GuidedDevice device(BenchTrocar(), [&](double) { return tip; });
  Servo servo(ServoSettingsOf(BenchScene(1)), {&device, nullptr});
  Vec3d last = Vec3d::Zero();
  double most = 0;
  for (std::uint64_t i = 0; i < 60000; ++i) {
    const Tick tick = TickAt(i);
    tip = Vec3d(0.02 * std::sin(0.003 * static_cast<double>(i)), 0.01 * normal(random) * (i % 50 == 0),
                0.01 * std::cos(0.007 * static_cast<double>(i)));
    if (i % 7 == 0) {
      ContactModel model;
      model.stamp = {i + 1, 1, tick.stamp_ns};
      model.tool_stamp_ns = tick.stamp_ns - 12'000'000;
      model.devices[0].count = static_cast<std::uint32_t>(1 + i % 4);
      for (Contact& c : model.devices[0].contacts) {
        c = TestTissue({}).Report();
        c.id = static_cast<std::uint32_t>(die(random));
        c.kind = die(random) < 50 ? ContactKind::kSurface : ContactKind::kGrasp;
        c.n = Vec3f(normal(random), normal(random), normal(random)).normalized();
        c.e1 = c.n.unitOrthogonal();
        c.x_ref = tip.cast<float>() * wild(1);
        c.f_ref = Vec3f(wild(1), wild(-2), wild(10));
        c.p_s.z() = wild(0.01f);
        c.v_s.x() = wild(0.01f);
        c.u_c = Vec3f(wild(0.001f), wild(0.002f), 0);
        c.du_c = Vec3f(wild(0.01f), 0, wild(0.02f));
        c.k1 = wild(2000);
        c.k3 = wild(1e6f);
        c.k_body = wild(500);
        c.b_body = wild(10);
        c.kappa1 = wild(20);
        c.radius = wild(0.02f);
        c.slip_force = wild(2);
      }
      servo.OfferModel(model, tick.stamp_ns);
    }
    servo.Step(tick);
    ASSERT_TRUE(device.force.allFinite()) << i;
    ASSERT_LE(device.force.norm(), 3.3f + 1e-12) << i;
    ASSERT_LE((device.force - last).norm(), 0.4f + 1e-12) << i;
    last = device.force;
    most = std::max(most, last.norm());
  }
  EXPECT_GT(servo.figures().models_dropped, 1000u);
  EXPECT_LT(servo.figures().models_dropped, 8500u);  // Some models did pass the gate.
  EXPECT_GT(most, 1.0);
}

TEST(Servo, ADeviceThatReadsNonsenseIsRiddenOver) {
  bool broken = false;
  GuidedDevice device(BenchTrocar(), [&](double) -> Vec3d {
    return broken ? Vec3d(Vec3d::Constant(std::numeric_limits<double>::quiet_NaN())) : Vec3d(0, 0, -0.003);
  });
  Loop loop(BenchScene(1), &device, {});
  loop.Run(1000, kNothing);
  const Vec3d before = device.force;
  broken = true;
  loop.Run(1, kNothing);
  broken = false;
  loop.Run(50, kNothing);
  EXPECT_LT((device.force - before).norm(), 0.02);
  EXPECT_TRUE(loop.servo.record().tool.tools[0].p_WT.allFinite());
}

// The force is continuous at each message: the arrival of a model adds less than 0.03 N per tick.
TEST(Servo, MessagesDoNotKick) {
  GuidedDevice device(BenchTrocar(), [](double t) { return Vec3d(0, 0, -0.003 + 0.002 * std::cos(2 * M_PI * 2 * t)); });
  Loop loop(BenchScene(1), &device, {});
  loop.Run(600, kNothing);
  Vec3d last = device.force;
  Vec3d before = last;
  double worst = 0;
  loop.Run(2000, [&](const Tick&) {
    // The second difference removes the rate of the motion itself.
    worst = std::max(worst, (device.force - 2 * last + before).norm());
    before = last;
    last = device.force;
  });
  EXPECT_LT(worst, 0.03);
}

std::vector<std::uint64_t> HashesOfARun(double depth) {
  GuidedDevice device(BenchTrocar(), [=](double t) { return Vec3d(0.01 * t, 0, -depth * std::sin(3 * t)); });
  Loop loop(BenchScene(0.3), &device, {});
  std::vector<std::uint64_t> hashes;
  loop.Run(1500, [&](const Tick&) { hashes.push_back(loop.servo.record().state_hash); });
  return hashes;
}

TEST(Servo, SameInputsGiveTheSameHashesAndOtherInputsOthers) {
  const std::vector<std::uint64_t> first = HashesOfARun(0.004);
  EXPECT_EQ(first, HashesOfARun(0.004));
  EXPECT_NE(first.back(), HashesOfARun(0.004001).back());
}

}  // namespace
}  // namespace fulcrum::haptics
