// The measure itself: the reference converges with its step, and the reference used as a solver has no error.
#include "tests/numerics/physics/standard_case.h"

#include <gtest/gtest.h>

#include <cmath>

#include "services/scene/builder/build.h"
#include "tests/numerics/physics/accurate_under_test.h"
#include "tests/numerics/physics/paper_solver.h"
#include "tests/numerics/physics/reference/explicit_dynamics.h"

namespace fulcrum::physics {
namespace {

using reference::Points;

/// Folds of the released sheet, and of the lips of a cut, are chaotic: no step is small enough to predict them.
constexpr double kReleaseFloor = 0.2, kCutFloor = 0.03;

/// The reference dynamics in the place of a solver.
class TruthSolver final : public SolverUnderTest {
 public:
  TruthSolver(const SceneView& scene, int steps)
      : energy_(BuildElasticModel(scene)), steps_(steps), frame_s_(static_cast<double>(scene.physics.dt_s)) {}

  void SetPositions(std::span<const float> xyz) override {
    const Points x = Eigen::Map<const Eigen::Matrix3Xf>(xyz.data(), 3, energy_.particle_count()).cast<double>();
    dynamics_ = std::make_unique<reference::ExplicitDynamics>(&energy_, x, frame_s_ / steps_);
  }
  void ReadPositions(std::span<float> xyz) const override {
    Eigen::Map<Eigen::Matrix3Xf>(xyz.data(), 3, energy_.particle_count()) = dynamics_->x().cast<float>();
  }
  void Hold(std::span<const Index> particles) override { held_.assign(particles.begin(), particles.end()); }
  void MoveHeld(std::span<const Vec3f> places) override {
    const double begin = dynamics_->time_s();
    std::vector<Vec3d> from, to;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      from.emplace_back(dynamics_->x().col(held_[i]));
      to.emplace_back(places[i].cast<double>());
    }
    dynamics_->Hold(held_, [this, begin, from, to](Index particle, double time_s) {
      const auto i = static_cast<std::size_t>(std::find(held_.begin(), held_.end(), particle) - held_.begin());
      return Vec3d(from[i] + (time_s - begin) / frame_s_ * (to[i] - from[i]));
    });
  }
  void CutEdges(std::span<const std::size_t> edges) override {
    for (const std::size_t edge : edges) {
      energy_.CutEdge(edge);
    }
  }
  void Step() override { dynamics_->Run(steps_); }

 private:
  reference::ElasticEnergy energy_;
  int steps_;
  double frame_s_;
  std::unique_ptr<reference::ExplicitDynamics> dynamics_;
  std::vector<Index> held_;
};

class StandardCaseTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene::SceneSettings settings = scene::Small();
    settings.membrane.rows = 37;
    settings.membrane.cols = 17;
    standard_ = new StandardCase(scene::BuildProcedural(settings), {5, 3, 0.012, 24, 3});
    truth_ = new StandardCase::Reference(standard_->ComputeReference());
  }
  static void TearDownTestSuite() {
    delete standard_;
    delete truth_;
  }
  static StandardCase* standard_;
  static StandardCase::Reference* truth_;
};
StandardCase* StandardCaseTest::standard_ = nullptr;
StandardCase::Reference* StandardCaseTest::truth_ = nullptr;

TEST_F(StandardCaseTest, TheCaseIsAsDescribed) {
  EXPECT_EQ(standard_->held().size(), 15u);
  EXPECT_EQ(standard_->cut_edges().size(), 48u);
  EXPECT_EQ(truth_->frames.size(), 20u);
  EXPECT_EQ(truth_->cut_frames.size(), 5u);
  EXPECT_LT(truth_->equilibrium_residual_N, 1e-8);
  EXPECT_LT(truth_->hold_residual_N, 1e-8);
  EXPECT_LT(truth_->force_N.z(), -0.05);  // The tissue pulls back.
  const Index middle = standard_->held()[7];
  EXPECT_NEAR(truth_->hold(2, middle) - truth_->equilibrium(2, middle), standard_->lift_m(), 1e-12);
  // The cut changes the shape of the tent.
  EXPECT_GT((truth_->cut_frames[4] - truth_->frames[9]).cwiseAbs().maxCoeff(), 5e-4);
}

TEST_F(StandardCaseTest, TheReferenceIsConvergedInItsStep) {
  const int steps = static_cast<int>(std::lround(StandardCase::kFrame_s / truth_->step_s));
  const StandardCase::Reference finer = standard_->ComputeReference(2 * steps);
  const auto difference = [&](const Points& x, const Points& y) {
    return (x - y).norm() / (finer.hold - finer.equilibrium).norm();
  };
  for (std::size_t frame = 0; frame < 16; ++frame) {
    EXPECT_LT(difference(truth_->frames[frame], finer.frames[frame]), 1e-4) << frame;
  }
  EXPECT_LT(difference(truth_->cut_frames[4], finer.cut_frames[4]), kCutFloor);
  EXPECT_LT(difference(truth_->frames[19], finer.frames[19]), kReleaseFloor);
}

/// Small and slow, so that no motion is chaotic: measures the order of central differences.
TEST(ExplicitDynamics, IsOfSecondOrder) {
  ElasticModel model;
  model.rest_position = {Vec3d::Zero(), Vec3d(0.01, 0, 0), Vec3d(0.02, 0, 0)};
  model.mass = {0, 1e-3, 2e-3};
  model.springs = {{0, 1, 0.009, 2.0}, {1, 2, 0.01, 1.0}};
  model.damping_per_s = 3;
  model.gravity = Vec3d(0, 0, -9.81);
  const reference::ElasticEnergy energy(model);
  const auto end = [&](int steps) {
    reference::ExplicitDynamics dynamics(&energy, reference::RestPoints(model), 0.2 / steps);
    dynamics.Run(steps);
    return dynamics.x();
  };
  const Points coarse = end(400), fine = end(800), finest = end(1600);
  EXPECT_NEAR((coarse - fine).norm() / (fine - finest).norm(), 4, 0.2);
}

TEST_F(StandardCaseTest, TheTruthHasNoError) {
  const int steps = static_cast<int>(std::lround(StandardCase::kFrame_s / truth_->step_s));
  const StandardRun run = RunStandardCase(
      *standard_, *truth_, [steps](const SceneView& scene) { return std::make_unique<TruthSolver>(scene, steps); },
      standard_->scene(), true);
  EXPECT_LT(run.errors.pull, 1e-3);  // Positions are handed over as floats.
  EXPECT_LT(run.errors.release, kReleaseFloor);
  EXPECT_LT(run.errors.cut, kCutFloor);
  EXPECT_LT(run.errors.hold, 0.05);  // The tissue still oscillates.
  EXPECT_EQ(run.frame_ms.size(), 100u);
  EXPECT_EQ(run.cut_frame_ms.size(), 25u);
}

TEST_F(StandardCaseTest, ModeAccurateIsNear) {
  const StandardRun run = RunStandardCase(
      *standard_, *truth_, [](const SceneView& scene) { return std::make_unique<AccurateUnderTest>(scene); },
      standard_->scene(), true);
  EXPECT_LT(run.errors.hold, 0.03);
  EXPECT_LT(run.errors.force, 0.01);
  EXPECT_LT(run.errors.pull, 0.05);
  EXPECT_LT(run.errors.cut, 0.1);
}

TEST_F(StandardCaseTest, ThePaperModeIsFarOff) {
  const StandardRun run = RunStandardCase(
      *standard_, *truth_, [](const SceneView& scene) { return std::make_unique<PaperSolver>(scene); },
      standard_->scene(), true);
  EXPECT_GT(run.errors.hold, 0.2);
  EXPECT_TRUE(std::isfinite(run.errors.pull + run.errors.release + run.errors.hold + run.errors.cut));
}

}  // namespace
}  // namespace fulcrum::physics
