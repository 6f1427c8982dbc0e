// The robustness matrix: states and motions that no operator intends, on every solver. All solvers stay finite; the
// accurate mode also returns to rest, leaves no tetrahedron inverted and creates no energy.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "services/base/core/sheets.h"
#include "services/scene/builder/build.h"
#include "tests/numerics/physics/accurate_under_test.h"
#include "tests/numerics/physics/paper_solver.h"
#include "tests/numerics/physics/reference/elastic_energy.h"
#include "tests/numerics/physics/sheets_under_test.h"
#include "tests/numerics/physics/xpbd_under_test.h"
#include "tests/support/flat_sheets.h"
#include "tests/support/several_solids.h"

namespace fulcrum::physics {
namespace {

using reference::ElasticEnergy;
using reference::Points;

constexpr double kReturnTime_s = 2.5, kLookTime_s = 0.5;
/// Largest RMS distance from rest over all particles, relative to the organ's length, where the membrane may stay
/// folded over itself, and elsewhere.
constexpr double kFoldedPart = 0.10, kReturnedPart = 0.02;
/// Apparent growth of energy, because velocities are differences of positions a frame apart, and apparent excess over
/// the work, because the work is a sum over frames.
constexpr double kEnergyMargin = 1.02, kWorkMargin = 1.05, kEnergyRounding_J = 1e-7;

enum class Content { kOneOrgan, kSeveralSolids, kSlidingSolids, kSheets };

/// The small scene and a sheet of 13 x 13 nodes with free sides across its membrane, 1 mm above it.
scene::SceneData OneSheetOverAnother() {
  scene::SceneSettings settings = scene::Small();
  scene::Anatomy anatomy = scene::ProceduralAnatomy(settings);
  Vec3d top = anatomy.sheets[0].nodes[0];
  for (const Vec3d& node : anatomy.sheets[0].nodes) top = node.z() > top.z() ? node : top;
  anatomy.sheets.push_back(
      FlatSheet("over", 13, 13, top + Vec3d(-0.012, -0.012, 0.001), Vec3d(0, 0.002, 0), Vec3d(0.002, 0, 0)));
  anatomy.sheets.back().sides_held = false;
  return scene::AssembleScene(settings, anatomy);
}

/// The small scene, perhaps with further solids or sheets, with the moduli of the standard case.
scene::SceneData MakeScene(Content content = Content::kOneOrgan) {
  const auto solids = [](scene::AttachKind kind) { return SeveralSolids(Vec3f::Zero(), true, true, kind); };
  scene::SceneData data = content == Content::kSeveralSolids   ? solids(scene::AttachKind::kGlued)
                          : content == Content::kSlidingSolids ? solids(scene::AttachKind::kSliding)
                          : content == Content::kSheets        ? OneSheetOverAnother()
                                                               : scene::BuildProcedural(scene::Small());
  PhysicsParams& physics = data.fixed.physics;
  physics.damping_per_s = 20;
  physics.membrane_Et_N_per_m = 300;
  physics.membrane_prestrain = 0.04f;
  physics.tube_youngs_modulus_Pa = 1e5f;
  physics.tube_poisson = 0.45f;
  return data;
}

/// One trial: a solver, its held particles, and its energy.
class Trial {
 public:
  Trial(const SceneView& scene, const SolverFactory& make)
      : scene_(scene),
        energy_(BuildElasticModel(scene)),
        rest_(reference::RestPoints(energy_.model())),
        solver_(make(scene)) {
    x_ = rest_;
    energy_.Gradient(rest_, &pull_);
    const SheetPart first = SheetsOf(scene)[0];
    const int rows = static_cast<int>(first.rows), cols = static_cast<int>(first.cols);
    for (int r = rows / 2 - 3; r <= rows / 2 + 3; ++r) {
      for (int c = cols / 2 - 1; c <= cols / 2 + 1; ++c) {
        patch_.push_back(scene.membrane.first + static_cast<Index>(r) * scene.membrane.cols + static_cast<Index>(c));
      }
    }
  }

  [[nodiscard]] const SceneView& scene() const { return scene_; }
  [[nodiscard]] const Points& rest() const { return rest_; }
  [[nodiscard]] const Points& x() const { return x_; }
  [[nodiscard]] bool finite() const { return finite_; }
  [[nodiscard]] bool Free(Index particle) const { return !energy_.model().fixed(particle); }
  [[nodiscard]] int FramesIn(double seconds) const {
    return std::max(1, static_cast<int>(std::lround(seconds / static_cast<double>(scene_.physics.dt_s))));
  }

  void Set(const Points& x) {
    const Eigen::Matrix3Xf xyz = x.cast<float>();
    solver_->SetPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
    x_ = x;
  }
  void HoldPatch() { solver_->Hold(patch_); }
  void MovePatch(const Vec3d& offset) {
    std::vector<Vec3f> places;
    for (const Index p : patch_) {
      places.push_back((rest_.col(p) + offset).cast<float>());
    }
    solver_->MoveHeld(places);
  }
  void Frame() {
    solver_->Step();
    const Points before = x_, pull_before = pull_;
    Eigen::Matrix3Xf xyz(3, rest_.cols());
    solver_->ReadPositions({xyz.data(), static_cast<std::size_t>(xyz.size())});
    x_ = xyz.cast<double>();
    finite_ = finite_ && x_.allFinite();
    moved_ = x_ - before;
    energy_.Gradient(x_, &pull_);
    for (const Index p : patch_) {
      work_ += (pull_before.col(p) + pull_.col(p)).dot(moved_.col(p)) / 2;
    }
  }
  /// Work done on the held patch, by the trapezoidal rule over frames [J].
  [[nodiscard]] double Work() const { return work_; }
  /// Elastic energy over that of the rest shape, and kinetic energy of the last frame's motion [J].
  [[nodiscard]] double Energy() const {
    return energy_.Energy(x_) - energy_.Energy(rest_) +
           reference::KineticEnergy(energy_.model(), moved_ / static_cast<double>(scene_.physics.dt_s));
  }
  /// Releases the patch and waits; the largest energy meanwhile relative to `given`.
  double Return(double given, double seconds) {
    solver_->Hold({});
    double most = 0;
    for (int i = FramesIn(seconds); i > 0 && finite_; --i) {
      Frame();
      most = std::max(most, Energy());
    }
    return (most - kEnergyRounding_J) / given;
  }
  [[nodiscard]] double DistanceFromRest() const {
    return std::sqrt((x_ - rest_).squaredNorm() / static_cast<double>(x_.cols()));
  }
  [[nodiscard]] int Inverted() const { return reference::InvertedTets(energy_.model(), x_); }
  [[nodiscard]] double OrganLength() const {
    const auto organ = rest_.leftCols(scene_.solids.empty() ? scene_.tube_vertex_count : scene_.solids[0].vertex_count);
    return (organ.rowwise().maxCoeff() - organ.rowwise().minCoeff()).maxCoeff();
  }

 private:
  SceneView scene_;
  ElasticEnergy energy_;
  Points rest_, x_, moved_, pull_;
  double work_ = 0;
  std::unique_ptr<SolverUnderTest> solver_;
  std::vector<Index> patch_;
  bool finite_ = true;
};

// -------------------------------------------------------------------------------------------- operations on the tissue

/// Lifts the patch by `height` in `seconds`; returns the energy there, including the kinetic energy of a fast pull.
double Pull(Trial* trial, double height, double seconds) {
  trial->HoldPatch();
  const int frames = trial->FramesIn(seconds);
  double most = 0;
  for (int i = 1; i <= frames && trial->finite(); ++i) {
    trial->MovePatch(Vec3d(0, 0, height * i / frames));
    trial->Frame();
    most = std::max(most, trial->Energy());
  }
  return most;
}
double PullLittle(Trial* trial) { return Pull(trial, 0.012, 0.5); }
/// The sheet beside the patch is 20 mm wide: the pull triples its length.
double PullToThreeTimes(Trial* trial) { return Pull(trial, 0.060, 1.0); }

double Place(Trial* trial, const Points& x) {
  trial->Set(x);
  return trial->Energy();
}
/// Multiplies the free particles' coordinates by `signs`.
double MirrorBy(Trial* trial, const Vec3d& signs) {
  Points x = trial->rest();
  for (Index p = 0; p < x.cols(); ++p) {
    if (trial->Free(p)) {
      x.col(p) = x.col(p).cwiseProduct(signs);
    }
  }
  return Place(trial, x);
}
double Mirror(Trial* trial) { return MirrorBy(trial, {-1, 1, 1}); }
double Scramble(Trial* trial) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> offset(-0.010, 0.010);
  Points x = trial->rest();
  for (Index p = 0; p < x.cols(); ++p) {
    const Vec3d by(offset(random), offset(random), offset(random));
    if (trial->Free(p)) {
      x.col(p) += by;
    }
  }
  return Place(trial, x);
}
/// Moves all free particles into one plane: no volume anywhere.
double Flatten(Trial* trial) {
  Points x = trial->rest();
  for (Index p = 0; p < x.cols(); ++p) {
    x(2, p) = trial->Free(p) ? 0 : x(2, p);
  }
  return Place(trial, x);
}
/// Moves blocks of nodes to one place: edges without a direction.
double Collapse(Trial* trial) {
  Points x = trial->rest();
  const MembraneGrid& grid = trial->scene().membrane;
  const Eigen::Index cols = grid.cols, first = grid.first;
  for (Eigen::Index r = 10; r < 60; r += 10) {
    for (Eigen::Index c = 5; c < 20; c += 5) {
      for (Eigen::Index i = 0; i < 9; ++i) {
        x.col(first + (r + i / 3) * cols + c + i % 3) = x.col(first + r * cols + c);
      }
    }
  }
  return Place(trial, x);
}
/// Moves the patch from one side of the organ to the other and through it, 60 mm per frame.
double Teleport(Trial* trial) {
  trial->HoldPatch();
  double most = 0;
  for (int i = 0; i < 20 && trial->finite(); ++i) {
    trial->MovePatch(Vec3d(i % 3 == 0 ? 0.02 : -0.02, 0, i % 2 == 0 ? 0.03 : -0.03));
    trial->Frame();
    most = std::max(most, trial->Energy());
  }
  return most;
}
double NotANumber(Trial* trial) {
  trial->HoldPatch();
  double most = 0;
  for (int i = 1; i <= 30 && trial->finite(); ++i) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    trial->MovePatch(i % 5 == 0 ? Vec3d(nan, 0, 0) : Vec3d(0, 0, 0.0003 * i));
    trial->Frame();
    most = std::max(most, trial->Energy());
  }
  return most;
}

// ----------------------------------------------------------------------------------------------- variants of the scene

void AsItIs(scene::SceneData*) {}
void LongSteps(scene::SceneData* data) { data->fixed.physics.dt_s *= 10; }
void ShortSteps(scene::SceneData* data) { data->fixed.physics.dt_s /= 10; }
void UnequalMasses(scene::SceneData* data) {
  std::mt19937 random(3);
  const float root = std::sqrt(1000.0f);
  for (float& w : data->inverse_mass) {
    w *= random() % 2 == 0 ? root : 1 / root;
  }
}
void UnequalStiffness(scene::SceneData* data) {
  data->fixed.physics.membrane_Et_N_per_m *= 100;
  data->fixed.physics.tube_youngs_modulus_Pa /= 100;
}
/// Moves nodes of the sheet almost onto their neighbours: edges of a ten-thousandth of their length.
void NoLength(scene::SceneData* data) {
  const Index rows = data->fixed.membrane.rows, cols = data->fixed.membrane.cols, first = data->fixed.membrane.first;
  for (Index r = 10; r < 60; r += 10) {
    Vec3f& node = data->rest_position[first + r * cols + 13];
    const Vec3f& neighbour = data->rest_position[first + r * cols + 12];
    node = neighbour + 1e-4f * (node - neighbour);
  }
  for (Index node = 0; node < rows * cols; ++node) {
    const Index to[3] = {node + 1, node + cols, node + cols + 1};
    for (Index d = 0; d < 3; ++d) {
      float& length = data->membrane_rest_length[3 * node + d];
      if (length > 0) {
        length = (data->rest_position[first + to[d]] - data->rest_position[first + node]).norm();
      }
    }
  }
}
/// Moves a free vertex of the organ almost into the plane of the opposite face: a tetrahedron of a thousandth of its
/// height.
void Sliver(scene::SceneData* data) {
  std::vector<Vec3f>& x = data->rest_position;
  const auto volume = [&](const Tetrahedron& t) {
    return (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).dot(x[t[3]] - x[t[0]]);
  };
  int made = 0;
  for (std::size_t i = 0; i < data->tets.size() && made < 5; ++i) {
    const Tetrahedron& t = data->tets[i];
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3f before = x[t[k]], &a = x[t[(k + 1) % 4]], &b = x[t[(k + 2) % 4]], &c = x[t[(k + 3) % 4]];
      const Vec3f normal = (b - a).cross(c - a).normalized();
      x[t[k]] = before - 0.999f * (before - a).dot(normal) * normal;
      const bool fits =
          data->inverse_mass[t[k]] > 0 && std::all_of(data->tets.begin(), data->tets.end(),
                                                      [&](const Tetrahedron& other) { return volume(other) > 0; });
      if (fits) {
        ++made;
        break;
      }
      x[t[k]] = before;
    }
  }
  ASSERT_GT(made, 0);
}

struct Abuse {
  const char* name;
  void (*scene)(scene::SceneData*);
  double (*act)(Trial*);  ///< Returns the energy that it added [J].
  double allowed;         ///< Distance from rest at the end, relative to the organ's length.
};
constexpr Abuse kMatrix[] = {
    {"PullToThreeTimes", AsItIs, PullToThreeTimes, kReturnedPart},
    {"Mirror", AsItIs, Mirror, kFoldedPart},
    {"Scramble", AsItIs, Scramble, kFoldedPart},
    {"LongSteps", LongSteps, PullLittle, kReturnedPart},
    {"ShortSteps", ShortSteps, PullLittle, kReturnedPart},
    {"UnequalMasses", UnequalMasses, PullLittle, kReturnedPart},
    {"UnequalStiffness", UnequalStiffness, PullLittle, kReturnedPart},
    {"NoLength", NoLength, PullLittle, kReturnedPart},
    {"Collapse", AsItIs, Collapse, kFoldedPart},
    {"Sliver", Sliver, PullLittle, kReturnedPart},
    {"Flatten", AsItIs, Flatten, kFoldedPart},
    {"Teleport", AsItIs, Teleport, kReturnedPart},
    {"NotANumber", AsItIs, NotANumber, kReturnedPart},
};

struct Mode {
  const char* name;
  SolverFactory make;
  bool strict;  ///< It must also return to rest.
  Content content = Content::kOneOrgan;
};
const Mode kModes[] = {
    {"paper", [](const SceneView& s) { return std::make_unique<PaperSolver>(s); }, false},
    {"xpbd", [](const SceneView& s) { return std::make_unique<XpbdUnderTest>(s); }, false},
    {"accurate", [](const SceneView& s) { return std::make_unique<AccurateUnderTest>(s); }, true},
    {"several", [](const SceneView& s) { return std::make_unique<AccurateUnderTest>(s); }, true,
     Content::kSeveralSolids},
    {"sliding", [](const SceneView& s) { return std::make_unique<AccurateUnderTest>(s); }, true,
     Content::kSlidingSolids},
    {"sheets", [](const SceneView& s) { return std::make_unique<SheetsUnderTest>(s); }, true, Content::kSheets},
};

const Mode& kAccurate = kModes[2];

class Robustness : public testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(Robustness, StaysFiniteAndComesBack) {
  const Mode& mode = kModes[std::get<0>(GetParam())];
  const Abuse& abuse = kMatrix[std::get<1>(GetParam())];
  scene::SceneData data = MakeScene(mode.content);
  abuse.scene(&data);
  const SceneView scene = data.View();
  Trial trial(scene, mode.make);
  const double given = abuse.act(&trial), work = trial.Work();
  const bool slides = mode.content == Content::kSlidingSolids;
  // Nothing leads what slides back; mirrored, its last two tetrahedra are still inverted after twice the time.
  const double times = slides && abuse.act == Mirror ? 4 : slides || mode.content == Content::kSeveralSolids ? 2 : 1;
  const double gained = trial.Return(given, mode.strict ? times * kReturnTime_s : kLookTime_s);
  ASSERT_TRUE(trial.finite());
  RecordProperty("left_mm", std::to_string(1e3 * trial.DistanceFromRest()));
  if (mode.strict) {
    EXPECT_LT(gained, kEnergyMargin);
    if (abuse.act == PullLittle || abuse.act == PullToThreeTimes) {
      EXPECT_LT(given, kWorkMargin * work);
    }
    EXPECT_LT(trial.DistanceFromRest(), abuse.allowed * trial.OrganLength());
    EXPECT_EQ(trial.Inverted(), 0);
  }
}

/// Long after a pull nothing moves: the residual of an unfinished solve must not sustain the motion.
TEST(ComesToRest, AfterAPull) {
  const scene::SceneData data = MakeScene();
  const SceneView scene = data.View();
  Trial trial(scene, kAccurate.make);
  const double given = PullLittle(&trial);
  (void)trial.Return(given, 10);
  EXPECT_LT(trial.Energy(), 1e-6 * given);
  EXPECT_LT(trial.DistanceFromRest(), 1e-6);
}

/// For any mirrored axis the wall of the organ unfolds completely; some cases take longer than others.
TEST(Folds, OpenWhicheverWayTheOrganIsMirrored) {
  const scene::SceneData data = MakeScene();
  const SceneView scene = data.View();
  for (const Vec3d& signs : {Vec3d(1, -1, 1), Vec3d(1, 1, -1), Vec3d(-1, -1, -1)}) {
    Trial trial(scene, kAccurate.make);
    const double given = MirrorBy(&trial, signs);
    EXPECT_LT(trial.Return(given, 5), kEnergyMargin);
    EXPECT_EQ(trial.Inverted(), 0) << signs.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Matrix, Robustness,
                         testing::Combine(testing::Range(0, static_cast<int>(std::size(kModes))),
                                          testing::Range(0, static_cast<int>(std::size(kMatrix)))),
                         [](const auto& test) {
                           return std::string(kModes[std::get<0>(test.param)].name) + "_" +
                                  kMatrix[std::get<1>(test.param)].name;
                         });

}  // namespace
}  // namespace fulcrum::physics
