#include "haptics_node/servo/contact_law.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics {
namespace {

using testing::TestTissue;
using testing::TissueParameters;

constexpr double kDt = 1e-3;

/// A contact at rest that touches the plane z = 0.
Contact TouchingPlane() {
  Contact contact;
  contact.kind = ContactKind::kSurface;
  contact.id = 1;
  contact.k1 = 500;
  contact.k_body = 1000;
  contact.b_body = 5;
  contact.friction = 0.3f;
  contact.kt = 400;
  return contact;
}

TEST(Skin, SolvesBothEquationsOverTheWholeGatedRange) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> decade(0, 1);
  for (int i = 0; i < 20000; ++i) {
    const double k1 = std::pow(10.0, 4.3 * decade(random));
    const double k3 = i % 4 == 0 ? 0.0 : std::pow(10.0, 12 * decade(random));
    const double compliance = std::pow(10.0, -7 + 6 * decade(random));
    const double depth = std::pow(10.0, -7 + 6 * decade(random));
    const double stretch = SolveSkin(k1, k3, compliance, depth);
    EXPECT_NEAR(stretch + compliance * (k1 * stretch + k3 * stretch * stretch * stretch), depth, 1e-9 * depth);
    const double force = std::pow(10.0, -4 + 5.3 * decade(random));
    const double alone = SkinStretch(k1, k3, force);
    EXPECT_NEAR(k1 * alone + k3 * alone * alone * alone, force, 1e-9 * force);
  }
}

// Skin and body in series: after a long press the force is depth / (1/k1 + 1/Kb), straight out of the plane.
TEST(ContactLaw, PressHoldEndsAtTheSeriesStiffness) {
  ContactState state;
  const ContactLaw law = MakeContactLaw(TouchingPlane(), 0.0, &state);
  ContactForce force;
  for (int i = 0; i < 1000; ++i) force = StepContact(law, Vec3d(0, 0, -0.003), i * kDt, kDt, &state);
  const double expected = 0.003 / (1.0 / 500 + 1.0 / 1000);
  EXPECT_NEAR(force.f_W.z(), expected, 1e-6);
  EXPECT_NEAR(force.f_W.head<2>().norm(), 0.0, 1e-9);
  EXPECT_NEAR(force.stored_J, 0.5 * expected * 0.003, 1e-6);
}

TEST(ContactLaw, FirstInstantIsStifferThanTheEnd) {
  ContactState state;
  const ContactLaw law = MakeContactLaw(TouchingPlane(), 0.0, &state);
  const double first = StepContact(law, Vec3d(0, 0, -0.003), kDt, kDt, &state).f_W.z();
  EXPECT_GT(first, 1.3 * 0.003 / (1.0 / 500 + 1.0 / 1000));
  EXPECT_LE(first, 0.003 * 500);
}

TEST(ContactLaw, OutsideTheSurfaceThereIsNoForce) {
  ContactState state;
  const ContactLaw law = MakeContactLaw(TouchingPlane(), 0.0, &state);
  EXPECT_EQ(StepContact(law, Vec3d(0.01, 0, 0.001), kDt, kDt, &state).f_W.norm(), 0.0);
}

TEST(ContactLaw, GapIsTheDistanceStillToGo) {
  Contact contact = TouchingPlane();
  contact.gap = 0.004f;
  contact.x_ref = Vec3f(0, 0, 0.02f);  // Contact begins 4 mm further down, independent of p_s.
  ContactState state;
  const ContactLaw law = MakeContactLaw(contact, 0.0, &state);
  EXPECT_EQ(StepContact(law, Vec3d(0, 0, 0.0161), kDt, kDt, &state).f_W.norm(), 0.0);
  EXPECT_GT(StepContact(law, Vec3d(0, 0, 0.0159), kDt, kDt, &state).f_W.z(), 0.0);
}

TEST(ContactLaw, FrictionLimitsAndOpposesSliding) {
  ContactState state;
  const ContactLaw law = MakeContactLaw(TouchingPlane(), 0.0, &state);
  ContactForce force;
  for (int i = 0; i < 500; ++i) force = StepContact(law, Vec3d(6e-5 * i, 0, -0.003), i * kDt, kDt, &state);
  EXPECT_LT(force.f_W.x(), 0.0);
  EXPECT_NEAR(-force.f_W.x(), 0.3f * force.f_W.z(), 1e-9);
}

TEST(ContactLaw, StickingPullsBackToTheAnchor) {
  ContactState state;
  const ContactLaw law = MakeContactLaw(TouchingPlane(), 0.0, &state);
  ContactForce force;
  for (int i = 0; i < 300; ++i) force = StepContact(law, Vec3d(0, 0, -0.003), i * kDt, kDt, &state);
  for (int i = 0; i < 2000; ++i) force = StepContact(law, Vec3d(2e-4, 0, -0.003), i * kDt, kDt, &state);
  const double drag = 2e-4 / (1.0 / 400 + 1.0 / 1000);
  EXPECT_NEAR(force.f_W.x(), -drag, 1e-6);
  // Springs that are stretched by d under the force f store f d / 2, along the surface as well as across it.
  EXPECT_NEAR(force.stored_J, 0.5 * force.f_W.z() * 0.003 + 0.5 * drag * 2e-4, 1e-7);
}

// A convex sphere of radius 20 mm touched at its top: sideways, along either tangent, the depth decreases with the
// sphere and the normal tilts.
TEST(ContactLaw, CurvatureFollowsASphere) {
  const double R = 0.02;
  Contact contact = TouchingPlane();
  contact.kappa1 = contact.kappa2 = static_cast<float>(1 / R);
  contact.kt = 0;
  contact.b_body = 0;
  const double angle = 0.1;
  for (const Vec3d& aside : {Vec3d(1, 0, 0), Vec3d(0, 1, 0)}) {
    ContactState state;
    const ContactLaw law = MakeContactLaw(contact, 0.0, &state);
    const Vec3d outward = std::sin(angle) * aside + Vec3d(0, 0, std::cos(angle));
    const Vec3d x = Vec3d(0, 0, -R) + (R - 0.001) * outward;
    const Vec3d f = StepContact(law, x, kDt, kDt, &state).f_W;
    EXPECT_NEAR(f.norm(), 0.001 / (1.0 / 500 + 1.0 / 1000), 0.02 * f.norm());  // Second order in the angle: 0.5 %.
    EXPECT_GT(f.normalized().dot(outward), std::cos(0.02));
  }
}

TEST(ContactLaw, ForceAtTheReferenceIsTheReferenceForce) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> u(-1, 1);
  for (int i = 0; i < 200; ++i) {
    Contact contact = TouchingPlane();
    contact.kind = i % 2 == 0 ? ContactKind::kSurface : ContactKind::kGrasp;
    contact.k3 = 1e6f;
    contact.n = Vec3f(u(random), u(random), u(random)).normalized();
    contact.e1 = contact.n.unitOrthogonal();
    contact.x_ref = 0.05f * Vec3f(u(random), u(random), u(random));
    contact.p_s = contact.x_ref + 0.005f * Vec3f(u(random), u(random), u(random));
    contact.u_c = 0.003f * Vec3f(u(random), u(random), u(random));
    contact.du_c = 0.01f * Vec3f(u(random), u(random), u(random));
    contact.kappa1 = 20 * u(random);
    contact.f_ref = 2 * contact.n + 0.1f * contact.e1;
    if (i % 2 == 0) contact.kappa1 = 0;  // The normal at x_ref is then that of the message.
    ContactState state;
    const ContactLaw law = MakeContactLaw(contact, 0.0, &state);
    // A step much shorter than the body's time constant: the force has not changed yet.
    const Vec3d f = StepContact(law, contact.x_ref.cast<double>(), 0, 1e-9, &state).f_W;
    EXPECT_LT((f - contact.f_ref.cast<double>()).norm(), 1e-3) << i;
  }
}

TEST(ContactLaw, GraspHoldsOnAllSidesAndSlipsAtItsForce) {
  Contact contact = TouchingPlane();
  contact.kind = ContactKind::kGrasp;
  contact.slip_force = 1.5f;
  ContactState state;
  const ContactLaw law = MakeContactLaw(contact, 0.0, &state);
  const Vec3d pull(0.0005, -0.001, 0.002);
  ContactForce force;
  for (int i = 0; i < 1000; ++i) force = StepContact(law, pull, i * kDt, kDt, &state);
  EXPECT_LT((force.f_W + pull / (1.0 / 500 + 1.0 / 1000)).norm(), 1e-6);
  EXPECT_NEAR(force.stored_J, 0.5 * pull.norm() * pull.norm() / (1.0 / 500 + 1.0 / 1000), 1e-8);  // f d / 2
  force = StepContact(law, 10 * pull, 1.0, kDt, &state);
  EXPECT_NEAR(force.f_W.norm(), 1.5, 1e-9);
  for (int i = 1; i < 100; ++i) {
    force = StepContact(law, 10 * pull, 1.0 + i * kDt, kDt, &state);
    EXPECT_LE(force.f_W.norm(), 1.5 + 1e-9);  // While it is held, the body relaxes.
  }
  // The grasp has slipped: a return by less than the slip does not reverse the force at once.
  force = StepContact(law, 9.9 * pull, 1.1, kDt, &state);
  EXPECT_LT(force.f_W.norm(), 1.5);
  EXPECT_LT(force.f_W.dot(pull), 0.0);
}

TEST(ContactLaw, MovingSurfaceCarriesItsContact) {
  Contact contact = TouchingPlane();
  contact.v_s = Vec3f(0.01f, 0, 0.02f);
  ContactState state;
  const ContactLaw law = MakeContactLaw(contact, 0.0, &state);
  ContactForce force;
  for (int i = 1; i <= 100; ++i) force = StepContact(law, Vec3d(1e-5 * i, 0, 2e-5 * i), i * kDt, kDt, &state);
  EXPECT_NEAR(force.f_W.norm(), 0.0, 1e-9);  // The contact moves with the tool.
}

TEST(ContactLaw, CouplingLimitsTheStiffnessFelt) {
  Contact contact = TouchingPlane();
  contact.k1 = 2e4f;
  contact.k_body = 2e5f;
  ContactState state;
  const ContactLaw law = MakeContactLaw(contact, 1.0 / 1000, &state);
  const double force = StepContact(law, Vec3d(0, 0, -0.002), kDt, kDt, &state).f_W.z();
  EXPECT_LT(force, 0.002 * 1000);
  EXPECT_GT(force, 0.9 * 0.002 * 1000);
}

TEST(ContactLaw, BeyondItsRadiusTheWallEnds) {
  Contact contact = TouchingPlane();
  contact.radius = 0.01f;
  contact.kt = 0;
  ContactState state;
  const ContactLaw law = MakeContactLaw(contact, 0.0, &state);
  EXPECT_GT(StepContact(law, Vec3d(0.0099, 0, -0.002), kDt, kDt, &state).f_W.z(), 0.5);
  EXPECT_EQ(StepContact(law, Vec3d(0.0201, 0, -0.002), kDt, kDt, &state).f_W.norm(), 0.0);
  // It ends gradually: halfway between one and two radii a smoothstep is 1/2.
  const auto first = [&](double aside) {
    ContactState fresh;
    const ContactLaw of_fresh = MakeContactLaw(contact, 0.0, &fresh);
    return StepContact(of_fresh, Vec3d(aside, 0, -0.002), kDt, kDt, &fresh).f_W.z();
  };
  EXPECT_NEAR(first(0.015) / first(0), 0.5, 1e-6);
}

// The law against tissue integrated explicitly at 20 us, over presses, slides and pulls.
TEST(ContactLaw, FollowsTheFinelyIntegratedTissue) {
  for (const bool grasp : {false, true}) {
    TissueParameters parameters;
    parameters.grasp = grasp;
    TestTissue tissue(parameters);
    tissue.Place(Vec3d::Zero());
    tissue.Step(Vec3d::Zero(), kDt);
    ContactState state;
    const ContactLaw law = MakeContactLaw(tissue.Report(), 0.0, &state);
    double error2 = 0;
    double size2 = 0;
    for (int i = 1; i <= 1000; ++i) {
      const double t = i * kDt;
      const double depth = 0.0015 * (1 - std::cos(2 * M_PI * 2 * t));
      const Vec3d x(0.002 * std::sin(2 * M_PI * t), 0, -depth);
      const Vec3d truth = tissue.Step(x, kDt);
      const Vec3d f = StepContact(law, x, t, kDt, &state).f_W;
      error2 += (f - truth).squaredNorm();
      size2 += truth.squaredNorm();
    }
    EXPECT_LT(std::sqrt(error2 / size2), 0.01) << (grasp ? "grasp" : "surface");
  }
}

// A closed path through the law, slow or fast, dissipates energy.
TEST(ContactLaw, ClosedCyclesDissipate) {
  for (const double frequency : {0.5, 2.0, 8.0, 30.0}) {
    ContactState state;
    const ContactLaw law = MakeContactLaw(TouchingPlane(), 2e-4, &state);
    double work = 0;  // Work of the tissue on the tool.
    Vec3d x = Vec3d::Zero();
    Vec3d f = Vec3d::Zero();
    const int ticks = static_cast<int>(2000 / frequency);
    for (int i = 1; i <= ticks; ++i) {
      const double phase = 2 * M_PI * frequency * i * kDt;
      const Vec3d next(0.001 * std::sin(phase), 0, -0.002 * (1 - std::cos(phase)));
      const Vec3d f_next = StepContact(law, next, i * kDt, kDt, &state).f_W;
      work += 0.5 * (f + f_next).dot(next - x);
      x = next;
      f = f_next;
    }
    EXPECT_LT(work, 1e-9) << frequency << " Hz";
  }
}

}  // namespace
}  // namespace fulcrum::haptics
