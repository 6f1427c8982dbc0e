// Gate, age machine, output chain and passivity controller, each separately.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "haptics_node/servo/age_machine.h"
#include "haptics_node/servo/model_gate.h"
#include "haptics_node/servo/output_chain.h"
#include "haptics_node/servo/passivity.h"
#include "haptics_node/servo/stiffness_correction.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr double kDt = 1e-3;
constexpr double kRounding = 1e-12;

ContactModel GoodModel() {
  ContactModel model;
  model.stamp = {5, 100, 1000 * kMs};
  model.tool_stamp_ns = 990 * kMs;
  model.devices[0].count = 1;
  model.devices[0].contacts[0] = testing::TestTissue({}).Report();
  return model;
}

TEST(ModelGate, AdmitsAGoodModelAndRefusesEachBrokenField) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<std::function<void(ContactModel&, Contact&)>> breaks = {
      [](ContactModel& m, Contact&) { m.devices[0].count = kMaxContacts + 1; },
      [](ContactModel& m, Contact&) { m.devices[1].count = 1; },  // Its contact is empty.
      [](ContactModel& m, Contact&) { m.devices[0].p_ext_W = 1; },
      [=](ContactModel& m, Contact&) { m.devices[0].force_cap_N = nan; },
      [](ContactModel& m, Contact&) { m.tool_stamp_ns = 0; },
      [](ContactModel& m, Contact&) { m.tool_stamp_ns = 2000 * kMs; },
      [](ContactModel& m, Contact&) { m.stamp.stamp_ns = 1100 * kMs; },
      [](ContactModel& m, Contact&) { m.stamp.epoch = ~std::uint64_t{0}; },
      [](ContactModel& m, Contact&) { m.stamp.epoch = 1002 * kMs; },
      [](ContactModel&, Contact& c) { c.kind = ContactKind::kNone; },
      [](ContactModel&, Contact& c) { c.n *= 1.02f; },
      [=](ContactModel&, Contact& c) { c.n.x() = nan; },
      [=](ContactModel&, Contact& c) { c.e1.x() = nan; },
      [=](ContactModel&, Contact& c) { c.x_ref.y() = inf; },
      [=](ContactModel&, Contact& c) { c.p_s.y() = nan; },
      [](ContactModel&, Contact& c) { c.v_s.z() = 11; },
      [](ContactModel&, Contact& c) { c.f_ref.z() = 20.1f; },
      [=](ContactModel&, Contact& c) { c.u_c.z() = nan; },
      [=](ContactModel&, Contact& c) { c.du_c.z() = -inf; },
      [=](ContactModel&, Contact& c) { c.gap = nan; },
      [](ContactModel&, Contact& c) { c.k1 = 0; },
      [](ContactModel&, Contact& c) { c.k1 = 2.1e4f; },
      [](ContactModel&, Contact& c) { c.k3 = -1; },
      [](ContactModel&, Contact& c) { c.kt = 2.1e4f; },
      [](ContactModel&, Contact& c) { c.k_body = 9; },
      [](ContactModel&, Contact& c) { c.k_body = 2.1e5f; },
      [](ContactModel&, Contact& c) { c.b_body = 2.1e3f; },
      [](ContactModel&, Contact& c) { c.friction = 2.1f; },
      [](ContactModel&, Contact& c) { c.kappa2 = -3e3f; },
      [=](ContactModel&, Contact& c) { c.slip_force = nan; },
      [=](ContactModel&, Contact& c) { c.radius = nan; },
  };
  ModelGate gate;
  EXPECT_TRUE(gate.Admit(GoodModel(), 1001 * kMs));
  for (std::size_t i = 0; i < breaks.size(); ++i) {
    ContactModel model = GoodModel();
    model.stamp.sequence = 6;
    model.stamp.stamp_ns = 1001 * kMs;
    breaks[i](model, model.devices[0].contacts[0]);
    EXPECT_FALSE(gate.Admit(model, 1001 * kMs)) << "break " << i;
  }
  EXPECT_EQ(gate.dropped(), breaks.size());
}

TEST(ModelGate, SequenceAndTimeMustGrowWithinAnEpochAndOldEpochsStayOut) {
  ModelGate gate;
  const auto admit = [&](std::uint64_t epoch, std::uint64_t sequence, std::int64_t stamp, std::int64_t tool_stamp) {
    ContactModel model = GoodModel();
    model.stamp = {sequence, epoch, stamp};
    model.tool_stamp_ns = tool_stamp;
    return gate.Admit(model, 5000 * kMs);
  };
  EXPECT_TRUE(admit(100, 5, 1000, 900));
  EXPECT_FALSE(admit(100, 5, 1010, 910));   // A repeated message.
  EXPECT_FALSE(admit(100, 6, 1000, 910));   // No progress of time.
  EXPECT_FALSE(admit(100, 6, 1010, 890));   // An older tool sample.
  EXPECT_TRUE(admit(100, 9, 1010, 900));    // Lost messages are no reason to refuse; nor is the same tool sample.
  EXPECT_TRUE(admit(200, 1, 1020, 910));    // Physics was restarted.
  EXPECT_FALSE(admit(100, 10, 1030, 920));  // A late message of the old process.
  EXPECT_TRUE(admit(200, 2, 1030, 920));
}

/// Sends a model every 10 ms, 15 ms old, while `fed`; returns the state after each tick.
class AgeRun {
 public:
  void Run(int ticks, bool fed) {
    for (int i = 0; i < ticks; ++i) {
      now += kMs;
      if (fed && now % (10 * kMs) == 0) {
        model = now - 15 * kMs;
        machine.OnModel(model, now);
      }
      machine.Step(model, contacts, now, kDt);
      largest_gain_step = std::max(largest_gain_step, std::abs(machine.gain() - last_gain));
      last_gain = machine.gain();
    }
  }
  AgeMachine machine;
  std::int64_t now = 1000 * kMs, model = 0;
  bool contacts = true;
  double last_gain = 0, largest_gain_step = 0;
};

TEST(AgeMachine, StartsOffAndRisesAfterThreeModelsIn250Ms) {
  AgeRun run;
  run.Run(100, false);
  EXPECT_EQ(run.machine.state(), ServoState::kOff);
  EXPECT_EQ(run.machine.gain(), 0.0);
  run.Run(25, true);  // Two models.
  EXPECT_EQ(run.machine.state(), ServoState::kOff);
  run.Run(5, true);  // The third.
  EXPECT_EQ(run.machine.state(), ServoState::kRise);
  run.Run(240, true);
  EXPECT_EQ(run.machine.state(), ServoState::kRise);
  run.Run(12, true);
  EXPECT_EQ(run.machine.state(), ServoState::kNormal);
  EXPECT_EQ(run.machine.gain(), 1.0);
  EXPECT_LT(run.largest_gain_step, 0.007);  // 1.5 / 250: the gain has no corner.
}

TEST(AgeMachine, HoldsAfter40MsFadesAfter100MsIn300Ms) {
  AgeRun run;
  run.Run(400, true);
  const std::int64_t newest = run.model;
  bool seen_hold = false;
  while (run.machine.state() != ServoState::kFade) {
    run.Run(1, false);
    const std::int64_t age = run.now - newest;
    if (run.machine.state() == ServoState::kHold) {
      seen_hold = true;
      EXPECT_GT(age, kNormalAge_ns);
      EXPECT_EQ(run.machine.damping(), kHoldDamping_Ns_m);
      EXPECT_EQ(run.machine.gain(), 1.0);
    }
  }
  EXPECT_TRUE(seen_hold);
  EXPECT_EQ(run.now - newest, 101 * kMs);
  run.Run(300, false);
  EXPECT_EQ(run.machine.gain(), 0.0);
  EXPECT_EQ(run.machine.state(), ServoState::kOff);
  EXPECT_LE(run.now - newest, 402 * kMs);
}

TEST(AgeMachine, AModelWithoutContactsHoldsNothingAndFadesAsOneWithThem) {
  AgeRun run;
  run.contacts = false;
  run.Run(400, true);
  run.Run(85, false);  // 100 ms old.
  EXPECT_EQ(run.machine.state(), ServoState::kNormal);
  EXPECT_EQ(run.machine.damping(), 0.0);
  run.contacts = true;
  run.Run(1, false);
  EXPECT_EQ(run.machine.state(), ServoState::kFade);
}

TEST(AgeMachine, ReturnNeedsThreeInARowAndContinuesFromWhereItFaded) {
  AgeRun run;
  run.Run(400, true);
  run.Run(200, false);  // Half faded.
  ASSERT_EQ(run.machine.state(), ServoState::kFade);
  const double before = run.machine.gain();
  EXPECT_GT(before, 0.1);
  run.Run(20, true);  // Two.
  EXPECT_EQ(run.machine.state(), ServoState::kFade);
  run.Run(10, true);  // Three.
  EXPECT_EQ(run.machine.state(), ServoState::kRise);
  EXPECT_LT(run.largest_gain_step, 0.007);
}

TEST(AgeMachine, ModelsThatComeOldAreNoReasonToReturn) {
  AgeRun run;
  run.Run(400, true);
  run.Run(600, false);
  for (int i = 0; i < 50; ++i) {
    run.now += 10 * kMs;
    run.model = run.now - 150 * kMs;
    run.machine.OnModel(run.model, run.now);
    run.machine.Step(run.model, true, run.now, 0.01);
  }
  EXPECT_EQ(run.machine.gain(), 0.0);
}

TEST(OutputChain, SmallForcesPassUnchangedAndLargeOnesMeetTheLimitSmoothly) {
  OutputChain chain;
  chain.slew_N_per_ms = 1e9;
  EXPECT_EQ(chain.Step(Vec3d(2.7, 0, 0), false, kDt), Vec3d(2.7, 0, 0));
  double last = 0;
  for (double f = 0; f < 20; f += 0.01) {
    const double sent = chain.Step(Vec3d(0, f, 0), false, kDt).norm();
    EXPECT_GE(sent, last - kRounding);
    EXPECT_LE(sent - last, 0.01 + 1e-12);  // Slope at most one, also at the knee.
    EXPECT_LE(sent, 3.3 + kRounding);
    last = sent;
  }
  EXPECT_GT(last, 3.29);
}

TEST(OutputChain, NeverExceedsLimitOrSlewWhateverComes) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-6, 320);
  std::uniform_int_distribution<int> kind(0, 9);
  std::normal_distribution<double> normal;
  OutputChain chain;
  Vec3d last = Vec3d::Zero();
  for (int i = 0; i < 100000; ++i) {
    Vec3d wanted(normal(random), normal(random), normal(random));
    wanted *= std::pow(10.0, exponent(random));
    if (kind(random) == 0) wanted.x() = std::numeric_limits<double>::quiet_NaN();
    if (kind(random) == 1) wanted.y() = -std::numeric_limits<double>::infinity();
    const bool creep = kind(random) < 3;
    const Vec3d sent = chain.Step(wanted, creep, kDt);
    ASSERT_TRUE(sent.allFinite());
    ASSERT_LE(sent.norm(), 3.3 + 1e-12);
    ASSERT_LE((sent - last).norm(), (creep ? 0.02 : 0.4) + 1e-12);
    last = sent;
  }
  EXPECT_GT(chain.not_finite, 0u);
}

// An active source (a force that assists the motion) can give no more energy than the tank.
TEST(Passivity, AnActiveSourceIsDampedOnceTheTankIsEmpty) {
  PassivityController controller;
  Vec3d sent = Vec3d::Zero();
  double given = 0;
  Vec3d x = Vec3d::Zero();
  for (int i = 1; i <= 20000; ++i) {
    const Vec3d next(0.002 * std::sin(2 * M_PI * 3 * i * kDt), 0, 0);
    const Vec3d moved = next - x;
    x = next;
    given += sent.dot(moved);
    const Vec3d active = 0.8 * moved / kDt;  // Negative viscosity of 0.8 N s/m.
    sent = controller.Step(active, sent, moved, 0.0, 0.0, kDt);
  }
  // Left alone the source gives 0.8 * mean(v^2) * 20 s = 11 mJ.
  EXPECT_LE(given, kTank_J + 1e-4);
}

// Breathing tissue does work on a hand that gives way; physics declares this power.
TEST(Passivity, PowerThatComesFromOutsideIsNotTheServosDebt) {
  PassivityController declared, undeclared;
  const Vec3d moved(1e-5, 0, 0), push(0.8, 0, 0);  // 8 mW.
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(declared.Step(push, push, moved, 0.0, 0.010, kDt), push);
    (void)undeclared.Step(push, push, moved, 0.0, 0.0, kDt);
  }
  EXPECT_LT(undeclared.Step(push, push, moved, 0.0, 0.0, kDt).x(), 0.8 - 0.02);
  EXPECT_GE(undeclared.Step(push, push, moved, 0.0, 0.0, kDt).x(), 0.8 - kMaxPassivityDamping_Ns_m * 0.01 - 1e-12);
}

TEST(Passivity, ASpringIsLeftAlone) {
  PassivityController controller;
  Vec3d sent = Vec3d::Zero();
  double x = 0;
  for (int i = 1; i <= 5000; ++i) {
    const double next = 0.003 * std::sin(2 * M_PI * 2 * i * kDt);
    const Vec3d moved(next - x, 0, 0);
    x = next;
    const Vec3d spring(-500 * x, 0, 0);
    sent = controller.Step(spring, sent, moved, 0.5 * 500 * x * x, 0.0, kDt);
    ASSERT_EQ(sent, spring) << i;
  }
}

/// A force that rises and falls; the model predicts too_stiff times each change.
void Teach(double too_stiff, double noise, int messages, StiffnessCorrection* correction) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  double force = 1.0;
  for (int i = 0; i < messages; ++i) {
    const double change = 0.3 * std::cos(0.4 * i);
    const double predicted = force + change * too_stiff * correction->scale();
    const double reported = (force + change) * (1.0 + noise * normal(random));
    correction->Learn(force, predicted, reported);
    force = reported;
  }
}

TEST(StiffnessCorrection, FindsTheScaleWithinAFewMessages) {
  for (const double too_stiff : {0.7, 1.0, 1.3}) {
    StiffnessCorrection correction;
    Teach(too_stiff, 0, 10, &correction);
    EXPECT_NEAR(correction.scale() * too_stiff, 1.0, 0.01) << too_stiff;
  }
}

TEST(StiffnessCorrection, NoiseOfTheReferenceForceMovesItLittle) {
  StiffnessCorrection correction;
  Teach(1.3, 0.02, 200, &correction);
  EXPECT_NEAR(correction.scale() * 1.3, 1.0, 0.1);
}

TEST(StiffnessCorrection, AHoldTeachesNothing) {
  StiffnessCorrection correction;
  for (int i = 0; i < 1000; ++i) correction.Learn(1.0, 1.0, i % 2 == 0 ? 1.02 : 0.98);
  EXPECT_EQ(correction.scale(), 1.0);
}

TEST(StiffnessCorrection, ATouchThatWasPredictedTooEarlyTeachesNothing) {
  StiffnessCorrection correction;
  for (int i = 0; i < 10; ++i) correction.Learn(0.0, 0.05, 0.0);
  EXPECT_EQ(correction.scale(), 1.0);
}

TEST(StiffnessCorrection, AJumpThatNoStiffnessExplainsIsNotLearnt) {
  StiffnessCorrection correction;
  correction.Learn(2.0, 2.1, 0.3);  // A slip or a cut.
  EXPECT_EQ(correction.scale(), 1.0);
}

TEST(StiffnessCorrection, StaysWithinItsBoundsWhateverComes) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> exponent(-9, 3);
  std::normal_distribution<double> normal;
  StiffnessCorrection correction;
  const auto wild = [&] { return normal(random) * std::pow(10.0, exponent(random)); };
  for (int i = 0; i < 100000; ++i) {
    if (i % 97 == 0) correction.ResetVariance();
    const double start = wild();
    correction.Learn(start, start + wild(), start + wild());
    ASSERT_LE(correction.scale(), kMaxStiffnessCorrection);
    ASSERT_GE(correction.scale(), 1 / kMaxStiffnessCorrection);
  }
  correction.Learn(1.0, std::numeric_limits<double>::quiet_NaN(), 1.0);
  EXPECT_TRUE(std::isfinite(correction.scale()));
}

}  // namespace
}  // namespace fulcrum::haptics
