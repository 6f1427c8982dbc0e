// Consistency of the reference: its forces are the derivatives of its energy.
#include <gtest/gtest.h>

#include <random>

#include "services/scene/builder/build.h"
#include "tests/numerics/physics/reference/explicit_dynamics.h"
#include "tests/numerics/physics/reference/static_solver.h"

namespace fulcrum::physics::reference {
namespace {

class ReferenceEnergy : public testing::TestWithParam<MembraneModel> {
 protected:
  static ElasticModel Model() {
    const scene::SceneData data = scene::BuildProcedural(scene::Small());
    SceneView view = data.View();
    view.physics.membrane_model = GetParam();
    view.physics.membrane_prestrain = 0.04f;
    view.physics.membrane_stiffening = 30.0f;
    view.physics.membrane_bending_Nm = 2e-3f;  // Strong enough to show.
    view.physics.gravity = Vec3f(0.5f, -1, -9.81f);
    return BuildElasticModel(view);
  }
  static Points Shaken(const ElasticModel& model, double amount, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> offset(-amount, amount);
    Points x = RestPoints(model);
    for (double& value : x.reshaped()) {
      value += offset(random);
    }
    return x;
  }
  static Points Direction(const ElasticModel& model, unsigned seed) {
    return Shaken(model, 1, seed) - RestPoints(model);
  }
};

TEST_P(ReferenceEnergy, GradientIsTheSlopeOfTheEnergy) {
  ElasticEnergy energy(Model());
  energy.CutEdge(3 * 700 + 1);
  const Points x = Shaken(energy.model(), 3e-4, 1);
  Points gradient;
  energy.Gradient(x, &gradient);
  for (unsigned seed = 2; seed < 5; ++seed) {
    const Points d = Direction(energy.model(), seed);
    const double h = 1e-8;
    const double slope = (energy.Energy(x + h * d) - energy.Energy(x - h * d)) / (2 * h);
    EXPECT_NEAR(gradient.cwiseProduct(d).sum(), slope, 2e-6 * gradient.norm());
  }
}

TEST_P(ReferenceEnergy, HessianIsTheSlopeOfTheGradient) {
  const ElasticEnergy energy(Model());
  const Points x = Shaken(energy.model(), 3e-4, 1), d = Direction(energy.model(), 2);
  const SparseMatrix H = energy.Hessian(x, false);
  Points after, before;
  const double h = 1e-9;
  energy.Gradient(x + h * d, &after);
  energy.Gradient(x - h * d, &before);
  const Eigen::VectorXd slope = (after - before).reshaped() / (2 * h);
  const Eigen::VectorXd product = H.selfadjointView<Eigen::Lower>() * d.reshaped();
  EXPECT_LT((slope - product).norm(), 1e-6 * product.norm());
}

TEST_P(ReferenceEnergy, TheClampedHessianIsPositiveAndTheSameWhereNothingIsClamped) {
  const ElasticEnergy energy(Model());
  const Points wild = Shaken(energy.model(), 3e-3, 1);
  const SparseMatrix clamped = energy.Hessian(wild, true), plain = energy.Hessian(wild, false);
  double lowest = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Eigen::VectorXd d = Direction(energy.model(), seed).reshaped();
    const double bend = d.dot(clamped.selfadjointView<Eigen::Lower>() * d);
    EXPECT_GE(bend, 0);
    lowest = std::min(lowest, d.dot(plain.selfadjointView<Eigen::Lower>() * d) - bend);
  }
  EXPECT_LT(lowest, 0);  // Clamping removed negative curvature in some direction.
}

TEST_P(ReferenceEnergy, RotationsCostNothingAndRestIsFreeOfForce) {
  ElasticModel model = Model();
  model.gravity.setZero();
  model.load.clear();
  model.hinges.clear();  // They keep the orientation of the rest shape, see their comment.
  // Removes the prestrain.
  for (ElasticSpring& spring : model.springs) {
    spring.rest_length *= 1.04f;
  }
  for (ElasticTriangle& triangle : model.triangles) {
    std::array<double, 3> lengths{};
    for (std::size_t i = 0; i < 3; ++i) {
      lengths[i] = model.springs[triangle.edges[i]].rest_length;
    }
    triangle.rest = RestOfTriangle(lengths, 150);
  }
  const ElasticEnergy energy(model);
  const Points x = RestPoints(model);
  const Mat3d R = Eigen::AngleAxisd(1.1, Vec3d(1, 2, -1).normalized()).toRotationMatrix();
  Points gradient;
  energy.Gradient(R * x, &gradient);
  EXPECT_LT(gradient.cwiseAbs().maxCoeff(), 2e-6);  // The scene's rest lengths are floats.
  EXPECT_NEAR(energy.Energy(R * x), 0, 1e-9);
  EXPECT_GT(energy.Energy(1.01 * x), 1e-4);
}

TEST_P(ReferenceEnergy, AnAffineStretchOfTheOrganCostsTheLaw) {
  ElasticModel model = Model();
  model.springs.clear();
  model.triangles.clear();
  model.hinges.clear();
  model.bindings.clear();
  model.load.clear();
  model.gravity.setZero();
  const ElasticEnergy energy(model);
  Mat3d F;
  F << 1.2, 0.1, 0, -0.05, 0.9, 0.2, 0, 0.03, 1.1;
  const Points x = F * RestPoints(model);
  const double psi = model.mu_Pa / 2 * (F.squaredNorm() - 3) - model.mu_Pa * (F.determinant() - 1) +
                     (model.lambda_Pa + model.mu_Pa) / 2 * std::pow(F.determinant() - 1, 2);
  EXPECT_NEAR(energy.Energy(x), psi * OrganVolume(model, RestPoints(model)), 1e-9 * energy.Energy(x));
}

TEST_P(ReferenceEnergy, EquilibriumIsWhereDynamicsComeToRest) {
  ElasticModel model = Model();
  model.stiffening = 0;
  model.damping_per_s = 300;
  const Points rest = RestPoints(model);
  const ElasticEnergy energy(model);
  const StaticResult still = SolveStatic(energy, rest, {}, {});
  EXPECT_LT(still.residual_N, 1e-8);
  EXPECT_EQ(InvertedTets(model, still.x), 0);
  ExplicitDynamics dynamics(&energy, rest, 0.5 / HighestFrequency(energy, rest));
  while (dynamics.time_s() < 0.1) {
    dynamics.Run(100);
  }
  const double moved = (still.x - rest).norm();
  EXPECT_GT(moved, 1e-3);
  EXPECT_LT((dynamics.x() - still.x).norm(), 0.01 * moved);
}

/// An edge that is cut takes its two triangles with it; what is left of their edges acts as springs, and nothing holds
/// the two sides together any more.
TEST_P(ReferenceEnergy, ACutLeavesTheEdgesAroundIt) {
  ElasticEnergy energy(Model());
  const Index cols = energy.model().springs[1].b - energy.model().springs[1].a;
  const std::size_t node = 30 * cols + 7, edge = 3 * node + 2;
  const Points x = Shaken(energy.model(), 3e-4, 1);
  const double whole = energy.Energy(x);
  energy.CutEdge(edge);
  const double cut = energy.Energy(x);
  EXPECT_LT(cut, whole);
  energy.CutEdge(edge);
  EXPECT_EQ(energy.Energy(x), cut) << "An edge is cut once.";
}

INSTANTIATE_TEST_SUITE_P(Models, ReferenceEnergy, testing::Values(MembraneModel::kSprings, MembraneModel::kContinuum),
                         [](const auto& model) {
                           return std::string(model.param == MembraneModel::kSprings ? "Springs" : "Continuum");
                         });

}  // namespace
}  // namespace fulcrum::physics::reference
