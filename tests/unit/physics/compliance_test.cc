// The haptic probe against tissue with a known response.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "physics_node/contact_model/compliance_probe.h"

namespace fulcrum::physics {
namespace {

/// A Kelvin-Voigt element in every direction.
class Element : public ComplianceSolver {
 public:
  Element(float k, float b) : k_(k), b_(b) {}
  bool Stiffness(const Probe& probe, float horizon_s, float* newton_per_m) override {
    ++questions;
    particles = probe.particles.size();
    const float part = horizon_s > 0.0f ? 1.0f - std::exp(-k_ * horizon_s / b_) : 1.0f;
    *newton_per_m = k_ / part;
    return answers;
  }
  int questions = 0;
  std::size_t particles = 0;
  bool answers = true;

 private:
  float k_, b_;
};

TEST(ComplianceProbe, FindsStiffnessAndViscosity) {
  for (const auto& [k, b] : {std::pair{200.0f, 4.0f}, {1000.0f, 5.0f}, {50.0f, 5.0f}}) {
    Element element(k, b);
    ComplianceProbe probe(0.01f);
    const std::vector<Index> touched{3, 5, 9};
    const Vec3f direction = Vec3f(1, 2, -2) / 3.0f;
    EXPECT_FALSE(probe.Update(0, touched, direction, &element).known);
    const Compliance& found = probe.Update(0, touched, direction, &element);
    ASSERT_TRUE(found.known);
    EXPECT_NEAR(found.stiffness, k, 1e-3f * k);
    EXPECT_NEAR(found.viscosity, b, 1e-2f * b);
    EXPECT_GT(found.fast, found.stiffness);
  }
}

TEST(ComplianceProbe, AsksOnceAStepAndBoundsItsLoad) {
  Element element(100, 1);
  ComplianceProbe probe(0.01f);
  std::vector<Index> touched(1000);
  std::iota(touched.begin(), touched.end(), 0u);
  for (int step = 1; step <= 10; ++step) {
    probe.Update(1, touched, Vec3f::UnitZ(), &element);
    EXPECT_EQ(element.questions, step);
  }
  EXPECT_EQ(element.particles, ComplianceProbe::kMaxParticles);
  probe.Update(1, {}, Vec3f::UnitZ(), &element);
  EXPECT_EQ(element.questions, 10);  // Without contact no solve is requested.
  EXPECT_TRUE(probe.compliance(1).known);
  probe.Reset(1);
  EXPECT_FALSE(probe.compliance(1).known);
}

TEST(ComplianceProbe, BadAnswersAreIgnored) {
  ComplianceProbe probe(0.01f);
  const std::vector<Index> touched{1};
  Element silent(100, 1), broken(-100, 1), rigid(1e9f, 1e6f);
  silent.answers = false;
  for (int i = 0; i < 4; ++i) {
    EXPECT_FALSE(probe.Update(0, touched, Vec3f::UnitX(), &silent).known);
    EXPECT_FALSE(probe.Update(0, touched, Vec3f::UnitX(), &broken).known);
    EXPECT_FALSE(probe.Update(0, touched, Vec3f::UnitX(), nullptr).known);
  }
  probe.Update(1, touched, Vec3f::UnitX(), &rigid);
  const Compliance& limited = probe.Update(1, touched, Vec3f::UnitX(), &rigid);
  ASSERT_TRUE(limited.known);
  EXPECT_LE(limited.stiffness, 5000.5f);
  EXPECT_TRUE(std::isfinite(limited.viscosity));
}

}  // namespace
}  // namespace fulcrum::physics
