// Solids that slide on each other: the energy's derivatives and invariants, known answers of two blocks, and the solver
// against the reference.
#include "physics_node/implicit/slides.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "services/base/core/solids.h"
#include "tests/numerics/physics/accurate_under_test.h"
#include "tests/numerics/physics/reference/slide_energy.h"
#include "tests/numerics/physics/reference/static_solver.h"
#include "tests/support/sliding_blocks.h"

namespace fulcrum::physics {
namespace {

using reference::ElasticEnergy;
using reference::Points;
using scene::AttachKind;

Points Shaken(const ElasticModel& model, double amount, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> offset(-amount, amount);
  Points x = reference::RestPoints(model);
  for (double& value : x.reshaped()) value += offset(random);
  return x;
}

Mat3d Turn(double angle_rad, const Vec3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
}

/// Two blocks in the solver: the lower one's lower side and the upper one's lower side held, and led.
class Blocks {
 public:
  explicit Blocks(AttachKind kind, const Mat3d& turn = Mat3d::Identity())
      : data_(TwoBlocks(kind, Vec3f::Zero(), turn)),
        scene_(data_.View()),
        energy_(BuildElasticModel(scene_)),
        solver_(scene_) {
    for (Index v = 0; v < scene_.tube_vertex_count; ++v) {
      if (scene_.inverse_mass[v] == 0.0f || (v >= upper() && v < upper() + kSideVertices)) held_.push_back(v);
    }
    solver_.Hold(held_);
  }

  /// Turns both blocks about the origin and moves the upper one, before that, evenly in `steps` steps; then waits.
  void Lead(const Vec3d& axis, double from_rad, double to_rad, const Vec3d& from, const Vec3d& to, int steps) {
    for (int i = 1; i <= steps + 40; ++i) {
      const double part = std::min(1.0, static_cast<double>(i) / steps);
      const Mat3d R = Turn(from_rad + part * (to_rad - from_rad), axis);
      std::vector<Vec3f> places;
      for (const Index v : held_) {
        places.push_back(
            Vec3d(R * (Rest(v) + (v >= upper() ? Vec3d(from + part * (to - from)) : Vec3d::Zero()))).cast<float>());
      }
      solver_.MoveHeld(places);
      solver_.Step();
    }
  }
  void Lead(const Vec3d& from, const Vec3d& to, int steps) { Lead(Vec3d::UnitX(), 0, 0, from, to, steps); }
  /// What the lower block does to the upper one [N].
  [[nodiscard]] Vec3d ForceOnUpper() const {
    Eigen::Matrix3Xf xyz(3, static_cast<Eigen::Index>(scene_.rest_position.size()));
    solver_.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
    return ForceAt(xyz.cast<double>());
  }
  /// The same in equilibrium by Newton's method, after `way`; if `rigid`, before any vertex has yielded.
  [[nodiscard]] Vec3d StaticForce(const Vec3d& way, bool rigid = false) const {
    Points x = reference::RestPoints(energy_.model());
    x.rightCols(x.cols() - upper()).colwise() += way;
    std::vector<bool> held(static_cast<std::size_t>(x.size()), false);
    for (const Index v : held_) std::fill_n(held.begin() + 3 * std::ptrdiff_t{v}, 3, true);
    return ForceAt(rigid ? x : reference::SolveStatic(energy_, x, held, {}, 1e-7).x);
  }

 private:
  static constexpr Index kSideVertices = 25;
  [[nodiscard]] Index upper() const { return scene_.solids[kUpperBlock].first_vertex; }
  [[nodiscard]] Vec3d Rest(Index v) const { return scene_.rest_position[v].cast<double>(); }
  /// Forces within a block add up to nothing.
  [[nodiscard]] Vec3d ForceAt(const Points& x) const {
    Points gradient;
    energy_.Gradient(x, &gradient);
    return -gradient.rightCols(x.cols() - upper()).rowwise().sum();
  }

  scene::SceneData data_;
  SceneView scene_;
  ElasticEnergy energy_;
  AccurateUnderTest solver_;
  std::vector<Index> held_;
};

/// In the plane sliding tissue holds with less than this of what glued tissue does; the solver is as near as this to
/// the equilibrium.
constexpr double kInPlane = 0.01, kOfForce = 0.01;
const Vec3d kAlong(0.002, 0, 0), kOff(0, 0, 0.0005);

TEST(SlidingBlocks, ThatDoNotYieldAreFreeInThePlaneAndAsGluedAlongTheNormal) {
  const Blocks glued(AttachKind::kGlued), sliding(AttachKind::kSliding);
  const Vec3d held = glued.StaticForce(kAlong, true), lifted = glued.StaticForce(kOff, true);
  EXPECT_LT(held.x(), -1);
  EXPECT_LT(sliding.StaticForce(kAlong, true).norm(), 1e-6 * held.norm());
  EXPECT_LT((sliding.StaticForce(kOff, true) - lifted).norm(), 1e-4 * lifted.norm());
}

TEST(SlidingBlocks, PulledInThePlaneAreFreeAndAlongTheNormalHold) {
  Blocks along(AttachKind::kSliding), off(AttachKind::kSliding);
  along.Lead(Vec3d::Zero(), kAlong, 40);
  off.Lead(Vec3d::Zero(), kOff, 40);
  const Vec3d held = Blocks(AttachKind::kGlued).StaticForce(kAlong), lifted = off.StaticForce(kOff);
  EXPECT_LT(along.ForceOnUpper().norm(), kInPlane * held.norm());
  EXPECT_LT((off.ForceOnUpper() - lifted).norm(), kOfForce * lifted.norm());
}

TEST(SlidingBlocks, ThatLieAnyWayAreTheSame) {
  const Vec3d upright = Blocks(AttachKind::kSliding).StaticForce(kOff);
  for (const Vec3d& axis : {Vec3d(0, 1, 0), Vec3d(1, 0.3, -0.2)}) {
    const Mat3d turn = Turn(std::numbers::pi / 2, axis);
    Blocks along(AttachKind::kSliding, turn), off(AttachKind::kSliding, turn);
    along.Lead(Vec3d::Zero(), turn * kAlong, 40);
    off.Lead(Vec3d::Zero(), turn * kOff, 40);
    EXPECT_LT(along.ForceOnUpper().norm(), kInPlane * upright.norm());
    EXPECT_LT((off.ForceOnUpper() - turn * upright).norm(), kOfForce * upright.norm());
  }
}

/// The plane turns with the tissue.
TEST(SlidingBlocks, TurnedByARightAngleWhileTheyAreJoinedAreTheSame) {
  const double right_angle = std::numbers::pi / 2;
  const Vec3d axis = Vec3d::UnitY();
  const Mat3d R = Turn(right_angle, axis);
  Blocks blocks(AttachKind::kSliding);
  const Vec3d lifted = blocks.StaticForce(kAlong + kOff);
  blocks.Lead(axis, 0, right_angle, Vec3d::Zero(), Vec3d::Zero(), 200);
  EXPECT_LT(blocks.ForceOnUpper().norm(), kInPlane * lifted.norm()) << "turned together";
  blocks.Lead(axis, right_angle, right_angle, Vec3d::Zero(), kAlong, 40);
  EXPECT_LT(blocks.ForceOnUpper().norm(), kInPlane * lifted.norm()) << "pulled in the plane";
  blocks.Lead(axis, right_angle, right_angle, kAlong, kAlong + kOff, 40);
  EXPECT_LT((R.transpose() * blocks.ForceOnUpper() - lifted).norm(), kOfForce * lifted.norm());
}

/// Over three triangles and more.
TEST(SlidingBlocks, SlideOnBeyondTheTrianglesOnWhichTheyBegan) {
  Blocks blocks(AttachKind::kSliding);
  const Vec3d far(0.017, 0.006, 0), lifted = blocks.StaticForce(far + kOff);
  blocks.Lead(Vec3d::Zero(), far, 150);
  EXPECT_LT(blocks.ForceOnUpper().norm(), kInPlane * lifted.norm());
  blocks.Lead(far, far + kOff, 40);
  EXPECT_LT((blocks.ForceOnUpper() - lifted).norm(), kOfForce * lifted.norm());
}

/// The loose block slides down: with drag c, x(t) = g sin(a) (t / c - (1 - exp(-c t)) / c^2).
TEST(SlidingBlocks, OnAnIncline) {
  const double angle = std::numbers::pi / 6, g = 9.81;
  const Vec3f gravity(static_cast<float>(g * std::sin(angle)), 0, static_cast<float>(-g * std::cos(angle)));
  for (const AttachKind kind : {AttachKind::kSliding, AttachKind::kGlued}) {
    const scene::SceneData data = TwoBlocks(kind, gravity);
    const SceneView scene = data.View();
    AccurateUnderTest solver(scene);
    const double c = static_cast<double>(scene.physics.damping_per_s), dt = static_cast<double>(scene.physics.dt_s);
    const int steps = 9;
    for (int i = 0; i < steps; ++i) solver.Step();
    Eigen::Matrix3Xf xyz(3, static_cast<Eigen::Index>(scene.rest_position.size()));
    solver.ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
    const Solid& upper = scene.solids[kUpperBlock];
    Vec3d moved = Vec3d::Zero();
    for (Index v = upper.first_vertex; v < upper.first_vertex + upper.vertex_count; ++v) {
      moved += (xyz.col(v) - scene.rest_position[v]).cast<double>() / upper.vertex_count;
    }
    const double t = steps * dt, free = g * std::sin(angle) * (t / c - (1 - std::exp(-c * t)) / (c * c));
    if (kind == AttachKind::kSliding) {
      EXPECT_NEAR(moved.x(), free, 0.15 * free);
    } else {
      EXPECT_LT(moved.x(), 0.1 * free);
    }
    EXPECT_LT(std::abs(moved.z()), 3e-4);
  }
}

class SlideEnergyTest : public testing::Test {
 protected:
  SlideEnergyTest()
      : data_(TwoBlocks(AttachKind::kSliding, Vec3f::Zero(), Turn(0.4, Vec3d(1, 2, 3)), true)),
        scene_(data_.View()),
        model_(BuildElasticModel(scene_)) {}

  scene::SceneData data_;
  SceneView scene_;
  ElasticModel model_;
};

TEST_F(SlideEnergyTest, RestIsFreeOfForce) {
  EXPECT_GT(model_.slides.size(), 15u);
  EXPECT_TRUE(model_.attachments.empty());
  Points gradient = Points::Zero(3, static_cast<Eigen::Index>(model_.mass.size()));
  reference::AddSlideGradient(model_, reference::RestPoints(model_), &gradient);
  EXPECT_LT(gradient.cwiseAbs().maxCoeff(), 1e-5);
}

TEST_F(SlideEnergyTest, GradientIsTheSlopeOfTheEnergy) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Points x = Shaken(model_, 4e-4, seed), d = Shaken(model_, 1, seed + 50) - reference::RestPoints(model_);
    Points gradient = Points::Zero(3, x.cols());
    reference::AddSlideGradient(model_, x, &gradient);
    const double h = 1e-9;
    const double slope =
        (reference::SlideEnergy(model_, x + h * d) - reference::SlideEnergy(model_, x - h * d)) / (2 * h);
    EXPECT_NEAR(gradient.cwiseProduct(d).sum(), slope, 1e-4 * gradient.norm());
  }
}

TEST_F(SlideEnergyTest, KeepsMomentumAndMomentOfMomentum) {
  const Points x = Shaken(model_, 6e-4, 3);
  Points gradient = Points::Zero(3, x.cols());
  reference::AddSlideGradient(model_, x, &gradient);
  Vec3d moment = Vec3d::Zero();
  for (Eigen::Index p = 0; p < x.cols(); ++p) moment += Vec3d(x.col(p)).cross(Vec3d(gradient.col(p)));
  EXPECT_GT(gradient.norm(), 0.1);
  EXPECT_LT(gradient.rowwise().sum().norm(), 1e-12 * gradient.norm());
  EXPECT_LT(moment.norm(), 1e-13 * gradient.norm());
}

/// What the solver uses against the reference, which looks at all triangles.
class SlidesInTheSolver : public SlideEnergyTest {
 protected:
  SlidesInTheSolver()
      : particles_(scene_),
        partition_(particles_, {}, SolidOfVertices(scene_), {}),
        regions_(partition_),
        slides_(model_, particles_) {}

  void Set(const Points& x) {
    const Eigen::Matrix3Xf xyz = x.cast<float>();
    const std::span<const float> floats(xyz.data(), static_cast<std::size_t>(xyz.size()));
    particles_.SetAll(floats, floats);
  }
  [[nodiscard]] const float* place() const { return particles_.raw().data(); }
  [[nodiscard]] Points Forces() const {
    std::vector<float> field(particles_.raw().size(), 0.0f);
    slides_.AddForce(field.data());
    Points force(3, static_cast<Eigen::Index>(model_.mass.size()));
    for (Index p = 0; p < force.cols(); ++p) force.col(p) = FieldAt(field.data(), particles_.Ref(p)).cast<double>();
    return force;
  }

  ParticleStore particles_;
  implicit::Partition partition_;
  implicit::Regions regions_;
  implicit::Slides slides_;
};

TEST_F(SlidesInTheSolver, HaveTheForcesAndTheEnergyOfTheReference) {
  for (unsigned seed = 1; seed < 6; ++seed) {
    const Points x = Shaken(model_, 4e-4, seed);
    Set(x);
    slides_.Linearise(place(), regions_);
    Points gradient = Points::Zero(3, x.cols());
    reference::AddSlideGradient(model_, x, &gradient);
    EXPECT_LT((Forces() + gradient).norm(), 2e-3 * gradient.norm());
    const double energy = reference::SlideEnergy(model_, x);
    EXPECT_NEAR(slides_.Energy(place()), energy, 1e-3 * energy);
  }
}

TEST_F(SlidesInTheSolver, HaveASymmetricPositiveMatrix) {
  const auto positive = [&](const Points& x) {
    Set(x);
    slides_.Linearise(place(), regions_);
    const std::size_t floats = particles_.raw().size();
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    for (int i = 0; i < 10; ++i) {
      std::vector<float> p(floats), q(floats), Kp(floats, 0.0f), Kq(floats, 0.0f);
      for (std::size_t k = 0; k < floats; ++k)
        p[k] = k % 4 == 3 ? 0 : normal(random), q[k] = k % 4 == 3 ? 0 : normal(random);
      const double pKp = slides_.Multiply(p.data());
      slides_.AddProduct(1, Kp.data());
      (void)slides_.Multiply(q.data());
      slides_.AddProduct(1, Kq.data());
      const auto dot = [](const std::vector<float>& a, const std::vector<float>& b) {
        double sum = 0;
        for (std::size_t k = 0; k < a.size(); ++k) sum += static_cast<double>(a[k]) * static_cast<double>(b[k]);
        return sum;
      };
      EXPECT_GE(pKp, 0);
      EXPECT_NEAR(dot(p, Kp), pKp, 1e-4 * pKp);
      EXPECT_NEAR(dot(q, Kp), dot(p, Kq), 1e-4 * pKp);
    }
  };
  positive(Shaken(model_, 4e-4, 1));
  positive(Shaken(model_, 1e-2, 1));            // Scrambled.
  positive(-reference::RestPoints(model_));     // Inside out.
  positive(0 * reference::RestPoints(model_));  // All in one point.
}

/// The upper block is led over the bumps and back on another way: what it takes to lead it is the difference of the
/// energy, over a closed way nothing.
TEST_F(SlidesInTheSolver, DoNoWorkOverAClosedWay) {
  const Points rest = reference::RestPoints(model_);
  const Mat3d R = Turn(0.4, Vec3d(1, 2, 3));
  const Index first = scene_.solids[kUpperBlock].first_vertex;
  const int steps = 4000;
  double work = 0, moved_energy = 0, positive = 0;
  Points before = rest, force_before = Points::Zero(3, rest.cols());
  double start = 0;
  for (int i = 0; i <= steps; ++i) {
    const double a = 2 * std::numbers::pi * i / steps;
    const Vec3d way = R * Vec3d(0.008 * (1 - std::cos(a)), 0.006 * std::sin(a), 0.0003 * std::sin(3 * a));
    Points x = rest;
    x.rightCols(rest.cols() - first).colwise() += way;
    Set(x);
    slides_.Linearise(place(), regions_);
    const Points force = Forces();
    if (i > 0) {
      const double part = -0.5 * (force + force_before).cwiseProduct(x - before).sum();
      work += part;
      positive += std::max(part, 0.0);
    } else {
      start = slides_.Energy(place());
    }
    const double energy = slides_.Energy(place());
    moved_energy = std::max(moved_energy, energy - start);
    EXPECT_NEAR(work, energy - start, 0.01 * (moved_energy + 1e-7)) << i;
    before = x;
    force_before = force;
  }
  EXPECT_GT(positive, 1e-5);
  EXPECT_LT(std::abs(work), 0.005 * positive) << "over the whole way";
}

}  // namespace
}  // namespace fulcrum::physics
