// Tools at several sheets: between two of them, and after a restart. Cracks at the rim of a sheet.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "physics_node/simulation/tissue_simulation.h"
#include "physics_node/tear/tear_watch.h"
#include "tests/support/flat_sheets.h"

namespace fulcrum::physics {
namespace {

/// Two sheets of 30 x 22 nodes, all of their rims held: the second `offset` from the first, which is about the origin.
scene::SceneData TwoSheets(PhysicsMode mode, const Vec3d& offset) {
  const Vec3d corner(-10.5 * kFlatCell_m, -14.5 * kFlatCell_m, 0), row(0, kFlatCell_m, 0), col(kFlatCell_m, 0, 0);
  scene::Anatomy anatomy;
  anatomy.sheets.push_back(FlatSheet("first", 30, 22, corner, row, col));
  anatomy.sheets.push_back(FlatSheet("second", 30, 22, corner + offset, row, col));
  return scene::AssembleScene(SheetSettings(mode), anatomy);
}

/// Largest and least height of the nodes of a sheet over rest [m].
std::pair<float, float> HeightsOf(const TissueSimulation& simulation, const SceneView& scene, const SheetPart& sheet) {
  float least = 0, largest = 0;
  for (std::uint32_t row = 0; row < sheet.rows; ++row) {
    for (std::uint32_t col = 0; col < sheet.cols; ++col) {
      const Index p = SheetParticle(scene, sheet, row, col);
      const float z = simulation.particles().At(simulation.particles().Ref(p)).z() - scene.rest_position[p].z();
      least = std::min(least, z);
      largest = std::max(largest, z);
    }
  }
  return {least, largest};
}

class BetweenTwoSheets : public testing::TestWithParam<PhysicsMode> {};

/// A bar between two sheets presses the lower one, near to the upper one but clear of it.
TEST_P(BetweenTwoSheets, AToolPressesOneOnly) {
  const scene::SceneData data = TwoSheets(GetParam(), Vec3d(0, 0, 0.004));
  SceneView scene = data.View();
  scene.tools[0].kind = ToolKind::kSuction;
  constexpr float kReach_m = 0.0019f;  // of the bar's axis from a sheet in contact: 0.2 mm of play between the two
  scene.tools[0].tip_length_m = 0.02f;
  scene.tools[0].tip_radius_m = scene.tools[0].shaft_radius_m = kReach_m - ContactMargin(scene, ToolPart::kJaw);
  const Quatf level = Quatf::FromTwoVectors(Vec3f::UnitZ(), Vec3f::UnitX());
  TissueSimulation simulation(scene);
  std::array<ToolInput, kMaxTools> tools{};
  for (int i = 0; i < 120; ++i) {
    const float height = 0.002f - 0.00002f * static_cast<float>(std::clamp(i - 20, 0, 30));
    tools[0] = {true, {Vec3f(0.008f, 0.003f, height), level, 0}};
    simulation.Step(tools);
  }
  const auto [pressed, raised] = HeightsOf(simulation, scene, scene.sheets[0]);
  EXPECT_LT(pressed, -0.0003f);
  EXPECT_LT(raised, 0.0002f);
  const auto [least, largest] = HeightsOf(simulation, scene, scene.sheets[1]);
  EXPECT_GT(least, -1e-6f);
  EXPECT_LT(largest, 1e-6f);
}

INSTANTIATE_TEST_SUITE_P(Modes, BetweenTwoSheets,
                         testing::Values(PhysicsMode::kPaper, PhysicsMode::kXpbd, PhysicsMode::kAccurate));

/// Tissue that was far from rest at the checkpoint is found by tools in the first step.
TEST(SheetsRestored, AreFoundFarFromRest) {
  const scene::SceneData data = TwoSheets(PhysicsMode::kAccurate, Vec3d(0.1, 0, 0));
  const SceneView scene = data.View();
  TissueSimulation simulation(scene), next(scene);
  std::vector<float> xyz(3 * scene.rest_position.size());
  simulation.particles().CopyPositions(xyz);
  const SheetPart& sheet = scene.sheets[0];
  const auto rows = static_cast<float>(sheet.rows - 1), cols = static_cast<float>(sheet.cols - 1);
  constexpr float kPi = 3.14159265f, kLift_m = 0.05f;
  for (std::uint32_t row = 0; row < sheet.rows; ++row) {
    for (std::uint32_t col = 0; col < sheet.cols; ++col) {
      xyz[3 * SheetParticle(scene, sheet, row, col) + 2] +=
          kLift_m * std::sin(kPi * static_cast<float>(row) / rows) * std::sin(kPi * static_cast<float>(col) / cols);
    }
  }
  std::array<ToolInput, kMaxTools> tools{};
  tools[0] = {true, {Vec3f(0, 0, kLift_m), Quatf(0, 1, 0, 0), 0}};
  simulation.Step(tools);
  ASSERT_TRUE(next.Restore(xyz, xyz, simulation.Save()));
  next.Step(tools);
  EXPECT_FALSE(next.collision().pairs().empty());
}

/// A crack is as long at the last column and row of a sheet, whose nodes have no edge beyond, as at the first.
TEST(TearsOfASheet, AreAsLongAtTheLastColumnAsAtTheFirst) {
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.physics.tear_stretch = 1.4f;
  settings.physics.membrane_prestrain = 0;
  scene::Anatomy anatomy;
  anatomy.sheets.push_back(FlatSheet("wide", 31, 31, Vec3d(-0.015, -0.015, 0), Vec3d(0, 0.001, 0), Vec3d(0.001, 0, 0)));
  const scene::SceneData data = scene::AssembleScene(settings, anatomy);
  const SceneView scene = data.View();
  // Pulled along one direction, most where the other coordinate is largest or least; all of the sheet is near the
  // limit.
  const auto torn = [&](int along, float most_at) {
    ParticleStore particles(scene);
    TissueModel model(scene, &particles);
    TearWatch tears(scene, &model, &particles);
    for (Index node = 0; node < scene.membrane.node_count(); ++node) {
      Vec3f p = scene.rest_position[scene.membrane.first + node];
      p[along] *= 1.42f + most_at * 2.0f * p[1 - along];
      particles.Set(particles.Ref(scene.membrane.first + node), p);
    }
    tears.RowsMoved(0, scene.membrane.rows, 0.1f);
    EXPECT_TRUE(tears.Evaluate(10));
    return tears.torn_count();
  };
  for (const int along : {0, 1}) {
    const std::uint32_t at_first = torn(along, -1), at_last = torn(along, 1);
    EXPECT_EQ(at_first, at_last) << (along == 1 ? "columns" : "rows");
    EXPECT_LE(at_last, 14u) << "5 cells in one direction, of each the edge and the diagonal";
  }
}

}  // namespace
}  // namespace fulcrum::physics
