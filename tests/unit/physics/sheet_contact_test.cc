// Contact of sheets with each other, and with themselves where SheetPairs::kAll is set.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "physics_node/implicit/elements.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"
#include "tests/support/flat_sheets.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::physics {
namespace {

using implicit::Elements;

constexpr auto kCell = static_cast<float>(kFlatCell_m);
/// Sheets touch at the sum of half their thicknesses [m].
constexpr float kThickness = ThermalParams{}.thickness_m;

Vec3f At(const TissueSimulation& simulation, Index particle) {
  return simulation.particles().At(simulation.particles().Ref(particle));
}
void Place(TissueSimulation* simulation, Index particle, const Vec3f& p) {
  simulation->particles().Set(simulation->particles().Ref(particle), p);
}
ToolInput Pointing(const Vec3f& tip) {
  ToolInput input;
  input.present = true;
  input.pose.q_WT = Quatf(0, 1, 0, 0);
  input.pose.p_WT = tip;
  return input;
}

/// Wakes all tissue where it is, at rest.
void Wake(TissueSimulation* simulation) {
  std::vector<float> xyz(3 * std::size_t{simulation->particles().particle_count()});
  simulation->particles().CopyPositions(xyz);
  EXPECT_TRUE(simulation->Restore(xyz, xyz, {}));
}

/// Sum of the normal forces between sheets at the present positions, at rest [N].
float SheetForce(const TissueSimulation& simulation) {
  float sum = 0;
  for (const ContactRow& row : simulation.rows()) {
    if (!Elements::IsOfSheets(row)) continue;
    const float depth = row.offset - row.normal.dot(row.At(simulation.particles().raw().data()));
    sum += std::max(depth, 0.0f) * Elements::ContactStiffness(row);
  }
  return sum;
}
std::size_t SheetRows(const TissueSimulation& simulation) {
  return static_cast<std::size_t>(
      std::count_if(simulation.rows().begin(), simulation.rows().end(), &Elements::IsOfSheets));
}

/// Height of p over the node of the lower sheet that is nearest in x and y [m].
float HeightOverLower(const TissueSimulation& simulation, const SceneView& scene, const Vec3f& p) {
  const SheetPart& lower = scene.sheets[0];
  float nearest = 1, height = 0;
  for (std::uint32_t r = 0; r < lower.rows; ++r) {
    for (std::uint32_t c = 0; c < lower.cols; ++c) {
      const Vec3f q = At(simulation, SheetParticle(scene, lower, r, c));
      const float apart = (p - q).head<2>().norm();
      if (apart < nearest) {
        nearest = apart;
        height = p.z() - q.z();
      }
    }
  }
  return height;
}

class SheetContact : public testing::Test {
 protected:
  /// Lowers the ends of the band at 20 mm/s by `depth`; they hold what is awake.
  static void LowerEnds(TissueSimulation* simulation, const SceneView& scene, float depth) {
    const SheetPart& band = scene.sheets[1];
    const int steps = static_cast<int>(std::lround(std::abs(depth) / 0.0002f));
    for (int i = 0; i < steps; ++i) {
      for (const std::uint32_t row : {0u, band.rows - 1}) {
        for (std::uint32_t col = 0; col < band.cols; ++col) {
          const Index p = SheetParticle(scene, band, row, col);
          Place(simulation, p, At(*simulation, p) - Vec3f(0, 0, std::copysign(0.0002f, depth)));
        }
      }
      simulation->Step({});
    }
  }
  /// Least height of the band's nodes over the middle of the lower sheet [m].
  static float LeastHeight(const TissueSimulation& simulation, const SceneView& scene) {
    const SheetPart& band = scene.sheets[1];
    float least = 1;
    for (std::uint32_t row = 8; row < band.rows - 8; ++row) {
      for (std::uint32_t col = 0; col < band.cols; ++col) {
        least =
            std::min(least, HeightOverLower(simulation, scene, At(simulation, SheetParticle(scene, band, row, col))));
      }
    }
    return least;
  }
};

TEST_F(SheetContact, ABandDoesNotPassThroughASheet) {
  scene::SceneData data = SheetAndBand(0.002);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene), ghost(scene);
  ghost.TakeSheetPairs(SheetPairs::kNone);
  Wake(&simulation);
  Wake(&ghost);
  LowerEnds(&simulation, scene, 0.008f);
  LowerEnds(&ghost, scene, 0.008f);
  EXPECT_GT(LeastHeight(simulation, scene), 0.0f);
  EXPECT_LT(LeastHeight(ghost, scene), -0.003f) << "without contact";
  EXPECT_GT(SheetForce(simulation), 0.02f);
  EXPECT_EQ(simulation.quarantined(), 0u);
  // Pulled apart there is no force.
  LowerEnds(&simulation, scene, -0.010f);
  EXPECT_EQ(SheetForce(simulation), 0.0f);
  for (int i = 0; i < 200; ++i) simulation.Step({});
  EXPECT_LT(simulation.MaxDisplacement(), 0.0045f) << "the band's ends are 2 mm from rest";
  EXPECT_EQ(SheetRows(simulation), 0u);
}

TEST_F(SheetContact, ABandFallsToTheSumOfHalfThicknesses) {
  scene::SceneData data = SheetAndBand(0.0008, Vec3f(0, 0, -9.81f));
  const SheetPart band = data.View().sheets[1];
  Free(&data, band);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene), ghost(scene);
  ghost.TakeSheetPairs(SheetPairs::kNone);
  for (int i = 0; i < 600; ++i) {
    simulation.Step({});
    ghost.Step({});
  }
  double sum = 0;
  int count = 0;
  for (std::uint32_t row = 9; row < band.rows - 9; ++row) {
    for (std::uint32_t col = 0; col < band.cols; ++col, ++count) {
      sum +=
          static_cast<double>(HeightOverLower(simulation, scene, At(simulation, SheetParticle(scene, band, row, col))));
    }
  }
  EXPECT_NEAR(sum / count, static_cast<double>(kThickness), 0.05e-3);
  EXPECT_LT(LeastHeight(ghost, scene), -0.002f) << "without contact";
}

/// Action equals reaction: the weights of each row sum up to zero.
TEST_F(SheetContact, ForcesSumUpToZero) {
  scene::SceneData data = SheetAndBand(0.002);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  Wake(&simulation);
  LowerEnds(&simulation, scene, 0.006f);
  Vec3f sum = Vec3f::Zero();
  float size = 0;
  for (const ContactRow& row : simulation.rows()) {
    if (!Elements::IsOfSheets(row)) continue;
    const float depth = row.offset - row.normal.dot(row.At(simulation.particles().raw().data()));
    const Vec3f force = std::max(depth, 0.0f) * Elements::ContactStiffness(row) * row.normal;
    for (const float weight : row.weight) sum += weight * force;
    size += force.norm();
  }
  ASSERT_GT(size, 0.01f);
  EXPECT_LT(sum.norm(), 1e-6f * size);
}

/// Two free sheets that fly at each other stay where their common centre is, and part no faster than they came.
TEST_F(SheetContact, ACollisionKeepsTheMomentumAndGainsNoSpeed) {
  constexpr double h = kFlatCell_m;
  scene::Anatomy anatomy;
  for (const double z : {0.0, 0.002}) {
    anatomy.sheets.push_back(FlatSheet(z > 0 ? "upper" : "lower", 17, 17, Vec3d(-8 * h + 0.3 * z, -8 * h, z),
                                       Vec3d(0, h, 0), Vec3d(h, 0, 0)));
  }
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.physics.damping_per_s = 0;
  scene::SceneData data = scene::AssembleScene(settings, anatomy);
  for (std::size_t i = 0; i < 2; ++i) Free(&data, data.View().sheets[i]);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  // 30 mm/s each.
  std::vector<float> now(3 * scene.rest_position.size()), before(now.size());
  simulation.particles().CopyPositions(now);
  before = now;
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::uint32_t r = 0; r < 17; ++r) {
      for (std::uint32_t c = 0; c < 17; ++c) {
        before[3 * SheetParticle(scene, scene.sheets[i], r, c) + 2] += i == 0 ? -0.0003f : 0.0003f;
      }
    }
  }
  ASSERT_TRUE(simulation.Restore(now, before, {}));
  const auto mean = [&](std::size_t i) {
    double z = 0;
    for (std::uint32_t r = 0; r < 17; ++r) {
      for (std::uint32_t c = 0; c < 17; ++c) {
        z += static_cast<double>(At(simulation, SheetParticle(scene, scene.sheets[i], r, c)).z());
      }
    }
    return z / (17 * 17);
  };
  double fastest_apart = 0, last = mean(1) - mean(0), least = last;
  for (int i = 0; i < 100; ++i) {
    simulation.Step({});
    const double apart = mean(1) - mean(0);
    least = std::min(least, apart);
    fastest_apart = std::max(fastest_apart, (apart - last) / 0.01);
    last = apart;
  }
  EXPECT_NEAR((mean(0) + mean(1)) / 2, 0.001, 0.02e-3);
  EXPECT_GT(least, 0.0) << "they have not passed through each other";
  EXPECT_LT(least, 0.5e-3) << "they have met";
  EXPECT_LT(fastest_apart, 0.06) << "no faster than they came";
}

/// One sheet laid back over itself: its first rows are held up to the fold behind row 20, what follows lies
/// `height` above them, and its last row is held there.
struct Fold {
  static constexpr std::uint32_t kRows = 44, kCols = 12, kFold = 20;
  scene::SceneData data;
  std::vector<float> xyz;
  /// @param beside another sheet, far away.
  explicit Fold(float height, bool beside = false) {
    constexpr double h = kFlatCell_m;
    scene::Anatomy anatomy;
    anatomy.sheets.push_back(FlatSheet("folded", kRows, kCols, Vec3d::Zero(), Vec3d(0, h, 0), Vec3d(h, 0, 0)));
    if (beside) {
      anatomy.sheets.push_back(FlatSheet("beside", 9, 9, Vec3d(0.2, 0, 0), Vec3d(0, h, 0), Vec3d(h, 0, 0)));
    }
    scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
    settings.physics.gravity = Vec3f(0, 0, -9.81f);
    settings.physics.membrane_bending_Nm = 1e-9f;
    settings.physics.membrane_Et_N_per_m = 20;
    settings.physics.membrane_prestrain = 0;
    data = scene::AssembleScene(settings, anatomy);
    const SheetPart sheet = data.View().sheets.empty() ? SheetsOf(data.View())[0] : data.View().sheets[0];
    Free(&data, sheet);
    for (std::uint32_t col = 0; col < kCols; ++col) data.inverse_mass[(kRows - 1) * kCols + col] = 0.0f;
    for (std::uint32_t row = 0; row <= kFold + 1; ++row) {
      for (std::uint32_t col = 0; col < kCols; ++col) data.inverse_mass[row * kCols + col] = 0.0f;
    }
    // Row 21 is above and behind row 20, a cell away; from there straight back.
    const float behind = std::sqrt(kCell * kCell - height * height);
    for (std::uint32_t row = 0; row < kRows; ++row) {
      for (std::uint32_t col = 0; col < kCols; ++col) {
        const float x = kCell * static_cast<float>(col), y = kCell * static_cast<float>(row);
        Vec3f p(x, y, 0);
        if (row > kFold) p = Vec3f(x, kCell * static_cast<float>(2 * kFold + 1) - y + behind, height);
        xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
      }
    }
    for (std::size_t i = xyz.size() / 3; i < data.rest_position.size(); ++i) {
      const Vec3f& p = data.rest_position[i];
      xyz.insert(xyz.end(), {p.x(), p.y(), p.z()});
    }
  }
};

TEST_F(SheetContact, AFoldedSheetDoesNotPassThroughItself) {
  const Fold fold(0.0008f);
  const SceneView scene = fold.data.View();
  TissueSimulation simulation(scene), ghost(scene);
  simulation.TakeSheetPairs(SheetPairs::kAll);
  ghost.TakeSheetPairs(SheetPairs::kNone);
  for (TissueSimulation* each : {&simulation, &ghost}) {
    ASSERT_TRUE(each->Restore(fold.xyz, fold.xyz, {}));
    for (int i = 0; i < 600; ++i) each->Step({});
  }
  float least = 1, ghost_least = 1;
  for (std::uint32_t row = Fold::kFold + 9; row < Fold::kRows - 8; ++row) {
    for (std::uint32_t col = 0; col < Fold::kCols; ++col) {
      const Index p = scene.membrane.first + row * Fold::kCols + col;
      least = std::min(least, At(simulation, p).z());
      ghost_least = std::min(ghost_least, At(ghost, p).z());
    }
  }
  // It wrinkles between its free sides, so most of it is farther from the lower half than the two are thick, and it
  // does not come to rest: no more is claimed than that it stays above.
  EXPECT_GT(least, 0.0f);
  EXPECT_LT(ghost_least, -0.0003f) << "without contact";
  EXPECT_EQ(simulation.quarantined(), 0u);
  // After a restart from where it lies it stays.
  std::vector<float> xyz(fold.xyz.size());
  simulation.particles().CopyPositions(xyz);
  TissueSimulation again(scene);
  again.TakeSheetPairs(SheetPairs::kAll);
  ASSERT_TRUE(again.Restore(xyz, xyz, {}));
  for (int i = 0; i < 100; ++i) again.Step({});
  for (std::uint32_t row = Fold::kFold + 9; row < Fold::kRows - 8; ++row) {
    EXPECT_GT(At(again, scene.membrane.first + row * Fold::kCols + 5).z(), 0.8f * kThickness) << row;
  }
}

/// A flap that a cut leaves, laid back upon the sheet.
TEST_F(SheetContact, AFlapOfACutLiesOnTheSheet) {
  constexpr double h = kFlatCell_m;
  constexpr std::uint32_t kSide = 41;
  scene::Anatomy anatomy;
  anatomy.sheets.push_back(FlatSheet("sheet", kSide, kSide, Vec3d::Zero(), Vec3d(0, h, 0), Vec3d(h, 0, 0)));
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.physics.gravity = Vec3f(0, 0, -9.81f);
  settings.physics.membrane_bending_Nm = 1e-9f;
  const scene::SceneData data = scene::AssembleScene(settings, anatomy);
  const SceneView scene = data.View();
  // The flap: rows 20 to 32, columns 14 to 26; it hangs on row 20.
  TopologyState topology = WholeTopology(scene);
  const auto in_flap = [](std::uint32_t r, std::uint32_t c) { return r >= 21 && r <= 32 && c >= 14 && c <= 26; };
  for (std::uint32_t r = 20; r < 34; ++r) {
    for (std::uint32_t c = 12; c < 28; ++c) {
      constexpr std::array<std::array<std::uint32_t, 2>, 3> kAway{{{0, 1}, {1, 0}, {1, 1}}};
      for (std::uint32_t d = 0; d < 3; ++d) {
        const std::uint32_t rr = r + kAway[d][0], cc = c + kAway[d][1];
        const bool hinge = r == 20 && rr == 21 && c >= 14 && cc <= 26;
        if (in_flap(r, c) != in_flap(rr, cc) && !hinge) SetBit(topology.dead_edges, 3 * (r * kSide + c) + d);
      }
    }
  }
  topology.revision = 1;
  std::vector<float> xyz(3 * scene.rest_position.size());
  TissueSimulation simulation(scene), ghost(scene);
  simulation.TakeSheetPairs(SheetPairs::kAll);
  ghost.TakeSheetPairs(SheetPairs::kNone);
  for (TissueSimulation* each : {&simulation, &ghost}) {
    ASSERT_GT(each->ApplyTopology(topology), 0);
    each->particles().CopyPositions(xyz);
    for (std::uint32_t r = 21; r <= 32; ++r) {
      for (std::uint32_t c = 14; c <= 26; ++c) {
        // Back over the sheet in an arc of 1 mm radius about row 20.
        const float s = kCell * static_cast<float>(r - 20), arc = 3.14159f * 0.001f;
        float* p = xyz.data() + 3 * (scene.membrane.first + r * kSide + c);
        p[1] = kCell * 20 + (s < arc ? 0.001f * std::sin(s / 0.001f) : -(s - arc));
        p[2] = s < arc ? 0.001f * (1 - std::cos(s / 0.001f)) : 0.002f;
      }
    }
    ASSERT_TRUE(each->Restore(xyz, xyz, {}));
    for (int i = 0; i < 600; ++i) each->Step({});
  }
  const auto height = [&](const TissueSimulation& of) {
    float least = 1;
    for (std::uint32_t r = 26; r <= 31; ++r) {
      for (std::uint32_t c = 16; c <= 24; ++c) {
        const Vec3f p = At(of, scene.membrane.first + r * kSide + c);
        const auto row = static_cast<std::uint32_t>(std::lround(p.y() / kCell));
        least = std::min(least, p.z() - At(of, scene.membrane.first + std::min(row, 19u) * kSide + c).z());
      }
    }
    return least;
  };
  EXPECT_GT(height(simulation), 0.15e-3f);
  EXPECT_LT(height(ghost), -0.001f) << "without contact";
  EXPECT_EQ(simulation.quarantined(), 0u);
}

/// Sheets that begin nearer to each other than they are thick do not move.
TEST_F(SheetContact, WhatOverlapsAtRestHasNoForce) {
  for (const double gap : {0.0002, 0.00002, 0.0, -0.0001}) {
    const scene::SceneData data = SheetAndBand(gap);
    TissueSimulation simulation(data.View());
    Wake(&simulation);
    for (int i = 0; i < 100; ++i) simulation.Step({});
    EXPECT_LT(SheetForce(simulation), 1e-3f) << gap;
    float moved = 0;
    const SceneView scene = data.View();
    const SheetPart& band = scene.sheets[1];
    for (std::uint32_t r = 0; r < band.rows; ++r) {
      const Index p = SheetParticle(scene, band, r, 3);
      moved = std::max(moved, (At(simulation, p) - scene.rest_position[p]).norm());
    }
    EXPECT_LT(moved, 0.05e-3f) << gap;
  }
}

/// Slack sheets that lie on themselves do not come to rest, so a session leaves them alone.
TEST_F(SheetContact, ASessionKeepsDifferentSheetsApartOnly) {
  const Fold fold(0.0008f, true);
  const SceneView scene = fold.data.View();
  TissueSimulation simulation(scene), ghost(scene);
  ghost.TakeSheetPairs(SheetPairs::kNone);
  for (TissueSimulation* each : {&simulation, &ghost}) {
    ASSERT_TRUE(each->Restore(fold.xyz, fold.xyz, {}));
    for (int i = 0; i < 60; ++i) each->Step({});
  }
  EXPECT_EQ(simulation.StateHash(), ghost.StateHash());
}

/// A sheet that stays unfolded has no pairs, however a tool pulls it, and the state that it has without.
TEST_F(SheetContact, AFlatSheetIsAsWithout) {
  const scene::SceneData data = SheetAndBand(0.02);
  TissueSimulation simulation(data.View()), ghost(data.View());
  simulation.TakeSheetPairs(SheetPairs::kAll);
  ghost.TakeSheetPairs(SheetPairs::kNone);
  std::array<ToolInput, kMaxTools> tools{};
  for (int i = 0; i < 150; ++i) {
    tools[0] = Pointing(Vec3f(0, 0.012f, 0.004f - 0.0001f * static_cast<float>(std::min(i, 100))));
    simulation.Step(tools);
    ghost.Step(tools);
    ASSERT_EQ(simulation.sheet_collision().pair_count(), 0u) << i;
    ASSERT_EQ(simulation.StateHash(), ghost.StateHash());
  }
  ASSERT_GT(simulation.MaxDisplacement(), 0.004f);
}

TEST_F(SheetContact, IsTheSameOnAnyNumberOfThreadsAndWithAnyKernels) {
  scene::SceneData data = SheetAndBand(0.002);
  const SceneView scene = data.View();
  TissueSimulation one(scene, 1);
  Wake(&one);
  LowerEnds(&one, scene, 0.006f);
  ASSERT_GT(SheetRows(one), 20u);
  for (const int threads : {2, 3}) {
    TissueSimulation more(scene, threads);
    more.LetThreadsHelp(true);
    Wake(&more);
    LowerEnds(&more, scene, 0.006f);
    EXPECT_EQ(more.StateHash(), one.StateHash()) << threads;
  }
  for (const InstructionSet set : kInstructionSets) {
    if (!Has(set)) continue;
    TissueSimulation other(scene, 1, set);
    Wake(&other);
    LowerEnds(&other, scene, 0.006f);
    EXPECT_EQ(other.StateHash(), one.StateHash());
  }
}

}  // namespace
}  // namespace fulcrum::physics
