// Clips as an energy: what it is zero for, its derivatives, known answers, and what becomes of it as tissue dies.
#include "physics_node/clips/clips.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>
#include <random>

#include "physics_node/clips/rigid_fit.h"
#include "services/scene/builder/build.h"
#include "tests/support/whole_topology.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

constexpr std::uint32_t kRows = 25, kCols = 25;
constexpr float kH = 0.002f;
const Vec3f kMiddle(0.024f, 0.024f, 0.0f);
constexpr auto kStiffness = static_cast<double>(Clips::kStiffness_N_per_m);

scene::SceneData AppliersScene() {
  scene::SceneData data = SheetScene(kRows, kCols, kH);
  data.fixed.tools[0] = {ToolKind::kClipApplier, Vec3f(0, 0, 0.15f), 0.0025f, 0.3f, 0.001f, 0.008f};
  return data;
}

Mat3d Turn(double angle_rad, const Vec3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
}

TEST(RigidFit, FindsTheRotationFromAnyStart) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Quaterniond truth =
        Eigen::Quaterniond(any(random), any(random), any(random), any(random)).normalized();
    const Eigen::Quaterniond start =
        Eigen::Quaterniond(any(random), any(random), any(random), any(random)).normalized();
    // From a long thin set to a flat one.
    const Vec3d sizes(1, 0.02 + std::abs(any(random)), trial % 2 == 0 ? 0.0 : 0.01);
    const Mat3d A = truth.toRotationMatrix() * sizes.asDiagonal();
    const Eigen::Quaterniond found = FitRotation(A, start);
    EXPECT_LT(truth.angularDistance(found), 1e-7) << trial;
  }
}

TEST(RigidFit, OfASetInOneLineKeepsItsTurnAboutTheLine) {
  const Vec3d line = Vec3d(1, 2, 3).normalized();
  const Eigen::Quaterniond start(Turn(0.7, line));
  const Mat3d A = line * line.transpose();
  EXPECT_LT(start.angularDistance(FitRotation(A, start)), 1e-7);
  const Mat3d R = Turn(0.3, Vec3d::UnitX());
  const Eigen::Quaterniond turned = FitRotation(R * A, start);
  EXPECT_LT((turned * line - R * line).norm(), 1e-7);
}

TEST(RigidFit, StaysWhereNothingIsKnown) {
  const Eigen::Quaterniond start(Turn(0.7, Vec3d(1, 2, 3)));
  EXPECT_EQ(FitRotation(Mat3d::Zero(), start).coeffs(), start.coeffs());
  EXPECT_EQ(FitRotation(Mat3d::Constant(std::numeric_limits<double>::quiet_NaN()), start).coeffs(), start.coeffs());
}

/// Two layers of nodes 1 mm apart in the jaws of an applier that points down.
class ClipOnTwoLayers : public testing::Test {
 protected:
  ClipOnTwoLayers() {
    for (Index r = 10; r < 14; ++r) {
      for (Index c = 8; c < 16; ++c) {
        const bool first = c < 12;
        const Index particle = r * kCols + c;
        const float down = 0.0015f * static_cast<float>(first ? 11 - c : c - 12);
        particles_.Set(particles_.Ref(particle),
                       kMiddle + Vec3f(first ? -0.0005f : 0.0005f, 0.0005f * static_cast<float>(r) - 0.006f, -down));
        (first ? first_ : second_).push_back(particle);
        held_.push_back(particle);
      }
    }
    pose_ = {kMiddle - Vec3f(0, 0, 0.006f), Quatf(0, 1, 0, 0), 0.0f};
    EXPECT_TRUE(clips_.Apply(0, scene_.tools[0], pose_, held_, particles_));
    Linearise();
  }
  void Linearise() {
    clips_.Linearise(particles_.pool(), [](ParticleRef) { return true; });
  }
  void Move(std::span<const Index> which, const Vec3f& by) {
    for (const Index p : which) particles_.Set(particles_.Ref(p), particles_.At(particles_.Ref(p)) + by);
  }
  /// Forces of the clip at where its particles are, 3 rows a particle of held_.
  [[nodiscard]] Eigen::VectorXd Force() {
    Linearise();
    FloatArray residual(particles_.raw().size());
    clips_.AddForce(residual.data());
    return Gather(residual);
  }
  [[nodiscard]] Eigen::VectorXd Gather(const FloatArray& field) const {
    Eigen::VectorXd v(3 * static_cast<Eigen::Index>(held_.size()));
    for (std::size_t i = 0; i < held_.size(); ++i) {
      v.segment<3>(3 * static_cast<Eigen::Index>(i)) = FieldAt(field.data(), particles_.Ref(held_[i])).cast<double>();
    }
    return v;
  }
  /// K at the last linearisation.
  [[nodiscard]] Eigen::MatrixXd Matrix() {
    const auto size = 3 * static_cast<Eigen::Index>(held_.size());
    Eigen::MatrixXd K(size, size);
    for (Eigen::Index i = 0; i < size; ++i) {
      FloatArray p(particles_.raw().size()), out(particles_.raw().size());
      PutField(p.data(), particles_.Ref(held_[static_cast<std::size_t>(i / 3)]), Vec3f::Unit(i % 3));
      EXPECT_GE(clips_.Multiply(p.data()), 0.0);
      clips_.AddProduct(1.0f, out.data());
      K.col(i) = Gather(out);
    }
    return K;
  }
  void Shake(double amount, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> any(-static_cast<float>(amount), static_cast<float>(amount));
    for (const Index p : held_) Move({&p, 1}, Vec3f(any(random), any(random), any(random)));
  }
  [[nodiscard]] double Energy() const { return clips_.Energy(particles_.raw().data()); }

  scene::SceneData data_ = AppliersScene();
  SceneView scene_ = data_.View();
  ParticleStore particles_{scene_};
  TissueModel model_{scene_, &particles_};
  Clips clips_{scene_};
  std::vector<Index> held_, first_, second_;
  ToolPose pose_;
};

TEST_F(ClipOnTwoLayers, RigidMotionStoresNoEnergy) {
  EXPECT_LT(Energy(), 1e-12);
  std::vector<Vec3f> rest;
  for (const Index p : held_) rest.push_back(particles_.At(particles_.Ref(p)));
  for (int step = 0; step <= 20; ++step) {  // Half a turn and 20 cm.
    const Mat3f R = Turn(0.157 * step, Vec3d(1, 0.4, -0.3)).cast<float>();
    for (std::size_t i = 0; i < held_.size(); ++i) {
      particles_.Set(particles_.Ref(held_[i]), R * rest[i] + 0.01f * static_cast<float>(step) * Vec3f(1, -1, 0.5f));
    }
    Linearise();
    EXPECT_LT(Energy(), 1e-10) << step;  // Rounding of 1e-8 m: 1e-11 J.
    EXPECT_LT(Force().cwiseAbs().maxCoeff(), 2e-4) << step;
  }
}

/// Known answer: layers of n/2 particles a distance s farther apart, without room to turn, pull with k (n/2) s/2.
TEST_F(ClipOnTwoLayers, LayersPulledApartPullBackWithTheSumOfTheForces) {
  const double apart_m = 2e-4, each = static_cast<double>(first_.size());
  ASSERT_EQ(first_.size(), second_.size());
  Move(first_, Vec3f(-1e-4f, 0, 0));
  Move(second_, Vec3f(1e-4f, 0, 0));
  const Eigen::VectorXd force = Force();
  Vec3d on_first = Vec3d::Zero(), all = Vec3d::Zero(), moment = Vec3d::Zero();
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const Vec3d f = force.segment<3>(3 * static_cast<Eigen::Index>(i));
    const bool first = std::find(first_.begin(), first_.end(), held_[i]) != first_.end();
    on_first += first ? f : Vec3d::Zero();
    all += f;
    moment += particles_.At(particles_.Ref(held_[i])).cast<double>().cross(f);
  }
  const double expected = kStiffness * each * apart_m / 2;
  EXPECT_NEAR(on_first.x(), expected, 1e-3 * expected);
  EXPECT_LT(all.norm(), 1e-5 * expected);
  EXPECT_LT(moment.norm(), 1e-6 * expected);
  EXPECT_NEAR(Energy(), expected * apart_m / 2, 2e-3 * expected * apart_m);
}

TEST_F(ClipOnTwoLayers, ForceIsTheGradientOfTheEnergy) {
  Shake(5e-4, 1);
  const Eigen::VectorXd force = Force();
  const float step = 2e-5f;
  for (std::size_t i = 0; i < held_.size(); i += 5) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3f by = step * Vec3f::Unit(axis);
      Move({&held_[i], 1}, by);
      const double more = Energy();
      Move({&held_[i], 1}, -2 * by);
      const double less = Energy();
      Move({&held_[i], 1}, by);
      EXPECT_NEAR((less - more) / (2 * static_cast<double>(step)), force(3 * static_cast<Eigen::Index>(i) + axis),
                  2e-3 * force.cwiseAbs().maxCoeff());
    }
  }
}

/// At rest K is the second derivative; strained it is not below it, and never indefinite.
TEST_F(ClipOnTwoLayers, MatrixIsNeverBelowTheSecondDerivative) {
  for (const double strain_m : {0.0, 3e-4, 1.5e-3}) {
    Shake(strain_m, 2);
    Linearise();
    const Eigen::MatrixXd K = Matrix();
    Eigen::MatrixXd exact(K.rows(), K.cols());
    const float step = 4e-5f;
    for (Eigen::Index i = 0; i < K.rows(); ++i) {
      const Index* const p = &held_[static_cast<std::size_t>(i / 3)];
      const Vec3f by = step * Vec3f::Unit(i % 3);
      Move({p, 1}, by);
      const Eigen::VectorXd more = Force();
      Move({p, 1}, -2 * by);
      exact.col(i) = (Force() - more) / (2 * static_cast<double>(step));
      Move({p, 1}, by);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> own(K),
        above(0.5 * (K + K.transpose() - exact - exact.transpose()));
    EXPECT_GT(own.eigenvalues().minCoeff(), -1e-4 * kStiffness) << strain_m;
    EXPECT_LT(own.eigenvalues().maxCoeff(), 1.0001 * kStiffness) << strain_m;
    EXPECT_GT(above.eigenvalues().minCoeff(), -0.003 * kStiffness) << strain_m;
    if (strain_m == 0.0) {
      EXPECT_LT((K - exact).cwiseAbs().maxCoeff(), 0.003 * kStiffness);
    }
  }
}

TEST_F(ClipOnTwoLayers, PlacesThatAreNotFiniteExertNothing) {
  particles_.Set(particles_.Ref(held_[3]), Vec3f(std::numeric_limits<float>::quiet_NaN(), 0, 0));
  EXPECT_EQ(Force().cwiseAbs().maxCoeff(), 0.0);
  EXPECT_EQ(Energy(), 0.0);
}

TEST_F(ClipOnTwoLayers, IsWhereTheJawsWere) {
  ClipState state;
  clips_.Fill(&state);
  ASSERT_EQ(state.count, 1u);
  const Clip& clip = state.clips[0];
  EXPECT_FLOAT_EQ(clip.length_m, scene_.tools[0].tip_length_m);
  std::array<Vec3f, 3> at;
  for (std::size_t k = 0; k < 3; ++k) at[k] = particles_.At(particles_.Ref(clip.anchors[k]));
  const std::optional<ClipPose> pose = PoseOf(clip, at[0], at[1], at[2]);
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->p_WC - pose_.ToWorld(Vec3f(0, 0, -0.5f * clip.length_m))).norm(), 1e-6f);
  EXPECT_LT(pose->q_WC.angularDistance(pose_.q_WT), 1e-3f);
}

/// What reads where a clip closes the vessels of a sheet has no use for vertices of a solid.
TEST(Clips, AreAnchoredOnTheSheetWhereTheyHoldSomeOfIt) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  data.fixed.tools[0] = {ToolKind::kClipApplier, Vec3f(0, 0, 0.15f), 0.0025f, 0.3f, 0.001f, 0.008f};
  const SceneView scene = data.View();
  const ParticleStore particles(scene);
  const auto anchors_of = [&](const std::vector<Index>& held) {
    Clips clips(scene);
    const ToolPose pose{scene.rest_position[held.back()], Quatf::Identity(), 0};
    EXPECT_TRUE(clips.Apply(0, scene.tools[0], pose, held, particles));
    ClipState state;
    clips.Fill(&state);
    return state.clips[0].anchors;
  };
  const std::vector<Index> of_the_organ{0, 5, 40, 100};
  std::vector<Index> of_both = of_the_organ;  // Those of the organ are far apart.
  const Index node = scene.membrane.first + 10 * scene.membrane.cols + 10;
  for (const Index next : {0u, 1u, scene.membrane.cols}) of_both.push_back(node + next);
  for (const Index anchor : anchors_of(of_both)) EXPECT_GE(anchor, scene.membrane.first);
  for (const Index anchor : anchors_of(of_the_organ)) EXPECT_LT(anchor, scene.tube_vertex_count);
}

TEST(Clips, AreAnchoredOnTheSheetThatTheyHoldMostOf) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  data.fixed.tools[0] = {ToolKind::kClipApplier, Vec3f(0, 0, 0.15f), 0.0025f, 0.3f, 0.001f, 0.008f};
  const std::uint32_t rows = data.View().membrane.rows, cols = data.View().membrane.cols, second_row = rows / 16 * 8;
  data.sheets = {{"front", 0, second_row - 1, cols, 0}, {"back", second_row, rows - second_row, cols, 0}};
  const SceneView scene = data.View();
  const Index first = scene.membrane.first, back = first + second_row * cols;
  // Three nodes of the one sheet, farther apart than the four of the other.
  std::vector<Index> held{first + 3, first + 8 * cols + 20, first + 5};
  for (const Index next : {0u, 1u, cols, cols + 1}) held.push_back(back + 2 * cols + 10 + next);
  const ParticleStore particles(scene);
  Clips clips(scene);
  ASSERT_TRUE(
      clips.Apply(0, scene.tools[0], {scene.rest_position[held.back()], Quatf::Identity(), 0}, held, particles));
  ClipState state;
  clips.Fill(&state);
  for (const Index anchor : state.clips[0].anchors) EXPECT_GE(anchor, back);
}

TEST_F(ClipOnTwoLayers, TwoClipsShareNoParticle) {
  EXPECT_FALSE(clips_.Apply(0, scene_.tools[0], pose_, held_, particles_));
  EXPECT_EQ(clips_.refused(), 1u);
  EXPECT_EQ(clips_.count(), 1u);
  const std::vector<Index> line{0, 1, 2, 3, 4};
  EXPECT_FALSE(clips_.Apply(0, scene_.tools[0], pose_, line, particles_)) << "in one line";
  std::vector<Index> more(held_.begin(), held_.begin() + 4);
  for (const Index p : {0u, 1u, kCols, kCols + 1}) more.push_back(p);
  EXPECT_TRUE(clips_.Apply(0, scene_.tools[0], pose_, more, particles_));
  EXPECT_EQ(clips_.Save().clips.back().tissue.size(), 4u);
  EXPECT_EQ(clips_.refused(), 2u);
}

TEST_F(ClipOnTwoLayers, TakesTheParticlesNearestToTheJaws) {
  std::vector<Index> many;
  for (Index p = 0; p < 3 * kCols; ++p) many.push_back(p);
  ASSERT_TRUE(clips_.Apply(0, scene_.tools[0], {Vec3f(0.024f, 0.0f, 0.0f), Quatf::Identity(), 0}, many, particles_));
  const AppliedClip clip = clips_.Save().clips.back();
  EXPECT_EQ(clip.tissue.size(), kMostClipped);
  EXPECT_EQ(clip.tissue.front().particle, 12u);
}

TEST_F(ClipOnTwoLayers, ForgetsDeadTissueAndFallsOffWithTheLast) {
  TopologyState cut = WholeTopology(scene_);
  std::size_t left = held_.size();
  for (const Index dead : held_) {
    SetBit(cut.dead_nodes, dead);
    ++cut.revision;
    ASSERT_GT(model_.Apply(cut, &particles_), 0);
    clips_.DropDead(model_, particles_);
    --left;
    if (clips_.empty()) break;
    ClipState state;
    clips_.Fill(&state);
    EXPECT_LE(clips_.Save().clips[0].tissue.size(), left);
    for (const Index anchor : state.clips[0].anchors) EXPECT_FALSE(TestBit(cut.dead_nodes, anchor));
    EXPECT_LT(Energy(), 1e-10);
  }
  EXPECT_TRUE(clips_.empty());
  EXPECT_EQ(clips_.lost(), 1u);
}

TEST_F(ClipOnTwoLayers, RestoresItselfAndRefusesWhatNoClipIs) {
  const ClipMemory memory = clips_.Save();
  const Index count = particles_.particle_count();
  Clips other(scene_);
  ASSERT_TRUE(other.Fits(memory, count));
  other.Restore(memory, particles_);
  Hash64 a, b;
  clips_.AddTo(&a);
  other.AddTo(&b);
  EXPECT_EQ(a.value(), b.value());
  EXPECT_NE(a.value(), Hash64().value());
  const auto refuses = [&](auto&& change) {
    ClipMemory bad = memory;
    change(&bad.clips[0]);
    return !other.Fits(bad, count);
  };
  EXPECT_TRUE(refuses([&](AppliedClip* c) { c->tissue[0].particle = count; }));
  EXPECT_TRUE(refuses([](AppliedClip* c) { c->tissue[0].particle = c->tissue[1].particle; }));
  EXPECT_TRUE(refuses([](AppliedClip* c) { c->tissue[0].p_C.x() = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refuses([](AppliedClip* c) { c->q_WC.w() = 3; }));
  EXPECT_TRUE(refuses([](AppliedClip* c) { c->placed.anchors[1] = c->placed.anchors[0]; }));
  EXPECT_TRUE(refuses([](AppliedClip* c) { c->placed.anchors[1] = 0; }));
  EXPECT_TRUE(refuses([](AppliedClip* c) { c->placed.length_m = 2; }));
  EXPECT_TRUE(refuses([](AppliedClip* c) { c->tissue.resize(2); }));
  EXPECT_FALSE(Clips(SheetScene(kRows, kCols, kH).View()).Fits(memory, count)) << "a scene without a clip applier";
}

}  // namespace
}  // namespace fulcrum::physics
