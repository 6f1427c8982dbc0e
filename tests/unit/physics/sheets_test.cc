// Several sheets in one grid, a sheet without an organ, an organ without a sheet.
#include "services/base/core/sheets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/simulation/tissue_simulation.h"
#include "physics_node/tear/tear_watch.h"
#include "services/scene/builder/build.h"
#include "tests/support/flat_sheets.h"
#include "tests/support/several_solids.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::physics {
namespace {

/// A flat sheet of `rows` x `cols` nodes, h apart, from `corner` along +x and +y.
scene::SheetBody Flat(const char* name, int rows, int cols, double h, const Vec3d& corner) {
  return FlatSheet(name, rows, cols, corner, Vec3d(0, h, 0), Vec3d(h, 0, 0));
}

/// A sheet of 30 x 22 nodes about the origin and, if there are `others`, a narrower one beside it and a band of one
/// cell above both.
scene::SceneData Sheets(PhysicsMode mode, bool others) {
  scene::Anatomy anatomy;
  anatomy.sheets.push_back(Flat("first", 30, 22, kFlatCell_m, Vec3d(-0.016, -0.022, 0)));
  if (others) {
    anatomy.sheets.push_back(Flat("second", 27, 14, kFlatCell_m, Vec3d(0.05, -0.02, 0)));
    anatomy.sheets.back().sides_held = false;
    anatomy.sheets.push_back(Flat("band", 25, 2, kFlatCell_m, Vec3d(0.02, -0.02, 0.06)));
    anatomy.sheets.back().sides_held = false;
  }
  return scene::AssembleScene(SheetSettings(mode), anatomy);
}

Vec3f At(const TissueSimulation& simulation, Index particle) {
  return simulation.particles().At(simulation.particles().Ref(particle));
}

/// A tool that points down, its tip at a place.
ToolInput Pointing(const Vec3f& tip, float jaw_rad = 0) {
  ToolInput input;
  input.present = true;
  input.pose.q_WT = Quatf(0, 1, 0, 0);
  input.pose.p_WT = tip;
  input.pose.jaw_rad = jaw_rad;
  return input;
}

/// Farthest that a node of a sheet is from rest [m].
float FarthestOf(const TissueSimulation& simulation, const SceneView& scene, const SheetPart& sheet) {
  float farthest = 0;
  for (std::uint32_t r = 0; r < sheet.rows; ++r) {
    for (std::uint32_t c = 0; c < sheet.cols; ++c) {
      const Index p = scene.membrane.first + (sheet.first_row + r) * scene.membrane.cols + c;
      farthest = std::max(farthest, (At(simulation, p) - scene.rest_position[p]).norm());
    }
  }
  return farthest;
}

class SeveralSheets : public testing::TestWithParam<PhysicsMode> {
 protected:
  scene::SceneData data_ = Sheets(GetParam(), true), alone_data_ = Sheets(GetParam(), false);
  SceneView scene_ = data_.View(), alone_ = alone_data_.View();
};

TEST_P(SeveralSheets, MoveAsAlone) {
  TissueSimulation simulation(scene_), alone(alone_);
  std::array<ToolInput, kMaxTools> tools{};
  for (int i = 0; i < 230; ++i) {
    const float part = 0.0001f * static_cast<float>(std::min(i, 80));  // Then it stands still.
    tools[0] = Pointing(Vec3f(0, part, 0.004f - part));
    simulation.Step(tools);
    alone.Step(tools);
  }
  ASSERT_GT(alone.MaxDisplacement(), 0.002f);
  for (Index node = 0; node < alone_.membrane.node_count(); ++node) {
    ASSERT_LT((At(simulation, node) - At(alone, node)).norm(), 1e-6f) << node;
  }
  EXPECT_LT(FarthestOf(simulation, scene_, scene_.sheets[1]), 1e-6f);
  EXPECT_LT(FarthestOf(simulation, scene_, scene_.sheets[2]), 1e-6f);
  EXPECT_EQ(simulation.quarantined(), 0u);
}

TEST_P(SeveralSheets, ArePulledOneByOne) {
  TissueSimulation simulation(scene_);
  std::array<ToolInput, kMaxTools> tools{};
  const Vec3f middle = scene_.rest_position[(scene_.sheets[1].first_row + 13) * scene_.membrane.cols + 7];
  for (int i = 0; i < 120; ++i) {
    const float lift = 0.00005f * static_cast<float>(std::max(i - 40, 0));
    tools[0] = Pointing(middle + Vec3f(0, 0, lift), i < 20 ? 0.8f : 0.0f);
    simulation.Step(tools);
  }
  EXPECT_TRUE(simulation.grasp(0).holding());
  EXPECT_GT(FarthestOf(simulation, scene_, scene_.sheets[1]), 0.003f);
  EXPECT_LT(FarthestOf(simulation, scene_, scene_.sheets[0]), 1e-6f);
  EXPECT_LT(FarthestOf(simulation, scene_, scene_.sheets[2]), 1e-6f);
}

INSTANTIATE_TEST_SUITE_P(Modes, SeveralSheets,
                         testing::Values(PhysicsMode::kPaper, PhysicsMode::kXpbd, PhysicsMode::kAccurate));

TEST(SheetsOfOneGrid, AreTheSameOnAnyNumberOfThreads) {
  const scene::SceneData data = Sheets(PhysicsMode::kAccurate, true);
  TissueSimulation one(data.View(), 1), three(data.View(), 3);
  three.LetThreadsHelp(true);
  std::array<ToolInput, kMaxTools> tools{};
  for (int i = 0; i < 60; ++i) {
    tools[0] = Pointing(Vec3f(0, 0, 0.003f - 0.0001f * static_cast<float>(i)));
    tools[1] = Pointing(Vec3f(0.06f, 0, 0.003f - 0.0001f * static_cast<float>(i)));
    one.Step(tools);
    three.Step(tools);
    ASSERT_EQ(one.StateHash(), three.StateHash()) << i;
  }
}

/// What nothing touches sleeps, and is no part of the solve.
TEST(SheetsOfOneGrid, SleepOneByOne) {
  const scene::SceneData data = Sheets(PhysicsMode::kAccurate, true);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  for (int i = 0; i < 100; ++i) simulation.Step({});
  ASSERT_TRUE(simulation.asleep());
  // The rows after a sheet, which belong to none, count as its.
  const float part = static_cast<float>(scene.sheets[2].first_row - scene.sheets[1].first_row) /
                     static_cast<float>(scene.membrane.rows);
  const Vec3f middle = scene.rest_position[(scene.sheets[1].first_row + 13) * scene.membrane.cols + 7];
  std::array<ToolInput, kMaxTools> tools{};
  float most = 0;
  for (int i = 0; i < 120; ++i) {
    tools[0] = Pointing(middle + Vec3f(0, 0, 0.003f - 0.00005f * static_cast<float>(i)));
    simulation.Step(tools);
    // The first body wakes with the first touch, for half a second.
    if (i >= 80) most = std::max(most, simulation.awake_part());
  }
  EXPECT_GT(FarthestOf(simulation, scene, scene.sheets[1]), 0.001f);
  EXPECT_GT(most, 0.1f);
  EXPECT_LE(most, part + 1e-4f);
}

TEST(SheetsOfOneGrid, ACutDividesOneOnly) {
  const scene::SceneData data = Sheets(PhysicsMode::kAccurate, true);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  const SheetPart& second = scene.sheets[1];
  const Index nodes = scene.membrane.node_count();
  TopologyState topology = WholeTopology(scene);
  // Two cuts across: what is between them is held by nothing, and fewer nodes than a piece has that is kept.
  for (const std::uint32_t row : {second.first_row + 9, second.first_row + 11}) {
    for (std::uint32_t c = 0; c < second.cols; ++c) {
      for (Index d = 1; d < 3; ++d) SetBit(topology.dead_edges, 3 * (row * scene.membrane.cols + c) + d);
    }
  }
  topology.revision = 1;
  simulation.ApplyTopology(topology);
  Index debris = 0;
  const std::vector<std::uint8_t> absent = AbsentNodes(scene);
  for (Index node = 0; node < nodes; ++node) {
    const bool is_absent = absent[node] != 0;
    EXPECT_EQ(simulation.model().IsAbsent(node), is_absent);
    debris += !is_absent && simulation.model().IsDebris(node) ? 1 : 0;
  }
  EXPECT_EQ(debris, 2u * 14);
  for (int i = 0; i < 100; ++i) simulation.Step({});
  EXPECT_LT(FarthestOf(simulation, scene, scene.sheets[0]), 1e-6f);
  EXPECT_EQ(simulation.quarantined(), 0u);
}

/// The cells under the metal are those of the sheet that it touches.
TEST(SheetsOfOneGrid, MetalTouchesTheOneBelow) {
  const scene::SceneData data = Sheets(PhysicsMode::kAccurate, true);
  const SceneView scene = data.View();
  ASSERT_EQ(scene.tools[1].kind, ToolKind::kHook);
  for (const std::size_t i : {0u, 1u, 2u}) {
    TissueSimulation simulation(scene);
    const SheetPart& sheet = scene.sheets[i];
    const Index node = (sheet.first_row + sheet.rows / 2) * scene.membrane.cols + sheet.cols / 2;
    std::array<ToolInput, kMaxTools> tools{};
    CauteryContact contact;
    for (int k = 0; k < 60; ++k) {
      tools[1] = Pointing(scene.rest_position[node] + Vec3f(0, 0, 0.003f - 0.00006f * static_cast<float>(k)));
      simulation.Step(tools);
      contact = simulation.Cautery(1);
    }
    ASSERT_TRUE(contact.touching) << sheet.name;
    EXPECT_TRUE(HasTriangle(scene, contact.triangle));
    const std::uint32_t row = contact.triangle / 2 / (scene.membrane.cols - 1);
    EXPECT_GE(row, sheet.first_row);
    EXPECT_LT(row, sheet.first_row + sheet.rows);
    EXPECT_LT((contact.material - scene.membrane_material[node]).norm(), 0.004f);
    EXPECT_GT(contact.footprint.gap.size(), 10u);
    EXPECT_TRUE(contact.tented) << "there is air on both sides";
  }
}

/// Bindings of a sheet are as stiff as without another one.
TEST(SheetsOfOneGrid, HaveBindingsOfTheirOwn) {
  const auto build = [](bool with_other) {
    scene::Anatomy anatomy;
    anatomy.solids.push_back(Box("pad", {-0.02, -0.02, 0}, {0.04, 0.04, 0.015}, {8, 8, 3}, 2e4));
    Fix(&anatomy.solids[0], [](const Vec3d& p) { return p.z() < 1e-6; });
    anatomy.sheets.push_back(Flat("wide", 17, 17, 0.002, Vec3d(-0.016, -0.016, 0.018)));
    anatomy.sheets.back().over = 0;
    if (with_other) {
      anatomy.sheets.push_back(Flat("fine", 21, 17, 0.0005, Vec3d(-0.004, -0.004, 0.016)));
      anatomy.sheets.back().over = 0;
    }
    return scene::AssembleScene(SheetSettings(PhysicsMode::kAccurate), anatomy);
  };
  const scene::SceneData alone = build(false), both = build(true);
  const std::vector<double> one = BindingStiffness(alone.View()), two = BindingStiffness(both.View());
  ASSERT_EQ(one.size(), 1u);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_GT(one[0], 0);
  EXPECT_EQ(two[0], one[0]);
  EXPECT_LT(two[1], 0.5 * one[0]) << "a sixteenth of the area each, three times as short";
  const ElasticModel model = BuildElasticModel(both.View());
  const SceneView scene = both.View();
  for (const ElasticBinding& b : model.bindings) {
    const bool is_first = (b.membrane - scene.membrane.first) / scene.membrane.cols < scene.sheets[1].first_row;
    EXPECT_EQ(b.stiffness, two[is_first ? 0 : 1]);
  }
}

/// A strip between two ends is a string: w^3 = 3 q L^4 / (64 E t) in the middle under the weight q per area, if it is
/// as stiff along its free sides as in the middle.
class Strip : public testing::TestWithParam<int> {};

TEST_P(Strip, SagsAsAString) {
  constexpr double kG = 3.2, kWeight_Pa = 0.5 * kG, kEt = 20, kLength_m = 40 * 0.002;
  scene::Anatomy anatomy;
  anatomy.sheets.push_back(Flat("wide", 20, 22, kFlatCell_m, Vec3d(0.05, 0, 0)));
  anatomy.sheets.push_back(Flat("strip", 41, GetParam(), 0.002, Vec3d::Zero()));
  anatomy.sheets.back().sides_held = false;
  anatomy.sheets.back().grid.density_kg_m2 = 0.5;
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.physics.gravity = Vec3f(0, 0, -static_cast<float>(kG));
  settings.physics.membrane_Et_N_per_m = kEt;
  settings.physics.membrane_stiffening = settings.physics.membrane_prestrain = 0;
  settings.physics.membrane_bending_Nm = 1e-9f;
  settings.physics.damping_per_s = 4;
  scene::SceneData data = scene::AssembleScene(settings, anatomy);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  for (int i = 0; i < 1500; ++i) simulation.Step({});
  const double expected = -std::cbrt(3 * kWeight_Pa * std::pow(kLength_m, 4) / (64 * kEt));
  const SheetPart& strip = scene.sheets[1];
  for (const std::uint32_t c : {0u, strip.cols / 2, strip.cols - 1}) {
    const Index node = (strip.first_row + 20) * scene.membrane.cols + c;
    EXPECT_NEAR(static_cast<double>(At(simulation, node).z()) / expected, 1, 0.015) << "column " << c;
  }
}

/// Second of two equal strips, with properties of its own.
constexpr SheetProperties kOwn{20, 1e-6f, 9e3f, 1.4f};
scene::SceneData TwoStrips(const scene::SceneSettings& settings, bool with_pad) {
  scene::Anatomy anatomy;
  if (with_pad) {
    anatomy.solids.push_back(Box("pad", {-0.02, -0.02, 0}, {0.2, 0.12, 0.015}, {8, 8, 3}, 2e4));
    Fix(&anatomy.solids[0], [](const Vec3d& p) { return p.z() < 1e-6; });
  }
  anatomy.sheets.push_back(Flat("first", 41, 6, 0.002, Vec3d(0, 0, 0.018)));
  anatomy.sheets.push_back(Flat("second", 41, 6, 0.002, Vec3d(0.1, 0, 0.018)));
  for (scene::SheetBody& sheet : anatomy.sheets) {
    sheet.sides_held = false;
    sheet.grid.density_kg_m2 = 0.5;
    if (with_pad) sheet.over = 0;
  }
  anatomy.sheets[1].own = kOwn;
  return scene::AssembleScene(settings, anatomy);
}

TEST(SheetsOfTheirOwn, HaveTheStiffnessThatASceneOfThatAloneWouldHave) {
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate), as_second = settings;
  as_second.physics.membrane_Et_N_per_m = kOwn.Et_N_per_m;
  as_second.physics.membrane_bending_Nm = kOwn.bending_Nm;
  as_second.physics.fat_youngs_modulus_Pa = kOwn.fat_youngs_modulus_Pa;
  const scene::SceneData data = TwoStrips(settings, true), other = TwoStrips(as_second, true);
  const SceneView scene = data.View();
  const ElasticModel model = BuildElasticModel(scene), second = BuildElasticModel(other.View());
  const auto is_second = [&](Index node) { return node / scene.membrane.cols >= scene.sheets[1].first_row; };
  int springs = 0;
  for (std::size_t i = 0; i < model.springs.size(); ++i) {
    if (!(model.springs[i].axial > 0)) continue;
    const bool same = model.springs[i].axial == second.springs[i].axial;
    EXPECT_EQ(same, is_second(static_cast<Index>(i / 3))) << "spring " << i;
    ++springs;
  }
  EXPECT_GT(springs, 0);
  ASSERT_FALSE(model.triangles.empty());
  ASSERT_FALSE(model.hinges.empty());
  for (std::size_t i = 0; i < model.triangles.size(); ++i) {
    const bool same = model.triangles[i].rest.stiffness == second.triangles[i].rest.stiffness;
    EXPECT_EQ(same, is_second(static_cast<Index>(model.triangles[i].edges[2] / 3))) << "triangle " << i;
  }
  for (std::size_t i = 0; i < model.hinges.size(); ++i) {
    const bool same = model.hinges[i].stiffness == second.hinges[i].stiffness;
    EXPECT_EQ(same, is_second(model.hinges[i].v[0] - scene.membrane.first)) << "hinge " << i;
  }
  ASSERT_FALSE(model.bindings.empty());
  for (std::size_t i = 0; i < model.bindings.size(); ++i) {
    const bool same = model.bindings[i].stiffness == second.bindings[i].stiffness;
    EXPECT_EQ(same, is_second(model.bindings[i].membrane - scene.membrane.first)) << "binding " << i;
  }
}

/// The other modes estimate forces from the edges, and the servo's skin is that of the sheet, in all of them.
TEST(SheetsOfTheirOwn, AreFeltAsTheirOwn) {
  for (const PhysicsMode mode : {PhysicsMode::kXpbd, PhysicsMode::kAccurate}) {
    scene::SceneSettings settings = SheetSettings(mode);
    settings.physics.membrane_Et_N_per_m = 150;
    const scene::SceneData data = TwoStrips(settings, false);
    DeviceContacts felt[2];
    for (const std::size_t sheet : {0u, 1u}) {
      TissueSimulation simulation(data.View());
      std::array<ToolInput, kMaxTools> tools{};
      for (int i = 0; i < 60; ++i) {
        const float x = sheet == 0 ? 0.005f : 0.105f;
        tools[1] = Pointing(Vec3f(x, 0.04f, 0.021f - 0.0001f * static_cast<float>(i)));
        simulation.Step(tools);
        felt[sheet] = simulation.Contacts(1);
      }
    }
    ASSERT_EQ(felt[0].count, 1u);
    ASSERT_EQ(felt[1].count, 1u);
    EXPECT_FLOAT_EQ(felt[0].contacts[0].k1 / felt[1].contacts[0].k1, 300.0f / 50) << "the softest skin is 50 N/m";
    EXPECT_GT(felt[0].contacts[0].f_ref.norm(), 3 * felt[1].contacts[0].f_ref.norm());
  }
}

/// As Strip, and with all edges shortened by heat: then w = q L^2 / (8 T), T = E t (1/s - 1 + 8/3 (w/L)^2) for edges of
/// the share s.
TEST(SheetsOfTheirOwn, SagAsStringsOfTheirOwnStiffness) {
  constexpr double kG = 3.2, kWeight_Pa = 0.5 * kG, kLength_m = 40 * 0.002, kShare = 0.99;
  scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
  settings.physics.gravity = Vec3f(0, 0, -static_cast<float>(kG));
  settings.physics.membrane_stiffening = settings.physics.membrane_prestrain = 0;
  settings.physics.membrane_bending_Nm = 1e-9f;
  settings.physics.damping_per_s = 4;
  const scene::SceneData data = TwoStrips(settings, false);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene);
  const auto sag = [&](std::size_t sheet) {
    const Index node = (scene.sheets[sheet].first_row + 20) * scene.membrane.cols + 3;
    return 0.018 - static_cast<double>(At(simulation, node).z());
  };
  for (int i = 0; i < 1500; ++i) simulation.Step({});
  const double Et[2] = {static_cast<double>(settings.physics.membrane_Et_N_per_m), kOwn.Et_N_per_m};
  for (const std::size_t sheet : {0u, 1u}) {
    EXPECT_NEAR(sag(sheet) / std::cbrt(3 * kWeight_Pa * std::pow(kLength_m, 4) / (64 * Et[sheet])), 1, 0.01) << sheet;
  }
  // The stiff one has been at rest for a while before; the soft one has come to rest all the same.
  EXPECT_TRUE(simulation.Step({}).asleep);
  TopologyState shrunk = WholeTopology(scene);
  shrunk.revision = 1;
  std::ranges::fill(shrunk.shrink, std::uint8_t{5});
  ASSERT_NEAR(1 - 5 * static_cast<double>(kShrinkUnit), kShare, 1e-6);
  ASSERT_GT(simulation.ApplyTopology(shrunk), 0);
  for (int i = 0; i < 1500; ++i) simulation.Step({});
  for (const std::size_t sheet : {0u, 1u}) {
    double w = 1e-3;
    for (int i = 0; i < 100; ++i) {
      const double tension = Et[sheet] * (1 / kShare - 1 + 8.0 / 3 * std::pow(w / kLength_m, 2));
      w = 0.5 * (w + kWeight_Pa * kLength_m * kLength_m / (8 * tension));
    }
    EXPECT_NEAR(sag(sheet) / w, 1, 0.03) << sheet;
  }
}

TEST(SheetsOfTheirOwn, TearAtTheirOwnStretch) {
  for (const float of_scene : {3.1f, 0.0f}) {
    scene::SceneSettings settings = SheetSettings(PhysicsMode::kAccurate);
    settings.physics.tear_stretch = of_scene;
    settings.physics.membrane_prestrain = 0;
    const scene::SceneData data = TwoStrips(settings, false);
    const SceneView scene = data.View();
    ParticleStore particles(scene);
    TissueModel model(scene, &particles);
    TearWatch tears(scene, &model, &particles);
    const auto pull = [&](float stretch) {
      for (Index node = 0; node < scene.membrane.node_count(); ++node) {
        Vec3f p = scene.rest_position[scene.membrane.first + node];
        p.y() *= stretch;
        particles.Set(particles.Ref(scene.membrane.first + node), p);
      }
      tears.RowsMoved(0, scene.membrane.rows, 0.1f);
      return tears.Evaluate(10);
    };
    EXPECT_FALSE(pull(1.35f));
    EXPECT_NEAR(tears.largest_stretch(), 1.35f, 1e-3f);
    EXPECT_NEAR(tears.nearest().stretch, 1.35f, 1e-3f);
    EXPECT_EQ(tears.nearest().limit, kOwn.tear_stretch);
    EXPECT_TRUE(pull(1.45f));
    for (std::size_t edge = 0; edge < 3 * std::size_t{scene.membrane.node_count()}; ++edge) {
      if (!TestBit(tears.torn(), edge)) continue;
      EXPECT_GE(edge / 3 / scene.membrane.cols, scene.sheets[1].first_row) << "edge " << edge;
    }
    EXPECT_GE(tears.torn_count(), 6u);
  }
}

INSTANTIATE_TEST_SUITE_P(Columns, Strip, testing::Values(2, 3, 6));

TEST(WithoutASheet, SolidsArePressedAndGrasped) {
  for (const PhysicsMode mode : {PhysicsMode::kPaper, PhysicsMode::kXpbd, PhysicsMode::kAccurate}) {
    scene::Anatomy anatomy;
    anatomy.solids.push_back(Box("pad", {-0.02, -0.02, 0}, {0.04, 0.04, 0.015}, {8, 8, 3}, 2e4));
    Fix(&anatomy.solids[0], [](const Vec3d& p) { return p.z() < 1e-6; });
    const scene::SceneData data = scene::AssembleScene(SheetSettings(mode), anatomy);
    const SceneView scene = data.View();
    ASSERT_EQ(scene.membrane.node_count(), 0u);
    TissueSimulation simulation(scene);
    std::array<ToolInput, kMaxTools> tools{};
    float force = 0;
    for (int i = 0; i < 100; ++i) {
      tools[0] = Pointing(Vec3f(0, 0, 0.018f - 0.00005f * static_cast<float>(i)), i < 60 ? 0.8f : 0.0f);
      tools[1] = Pointing(Vec3f(0.01f, 0, 0.018f - 0.00005f * static_cast<float>(i)));
      simulation.Step(tools);
      (void)simulation.Contacts(0);
      (void)simulation.Contacts(1);
      EXPECT_FALSE(simulation.Cautery(1).touching);
      force = std::max(force, simulation.force(1).norm());
    }
    EXPECT_TRUE(simulation.grasp(0).holding());
    EXPECT_GT(force, 0.01f);
    EXPECT_GT(simulation.MaxDisplacement(), 0.0005f);
    EXPECT_LT(simulation.MaxDisplacement(), 0.006f);
    EXPECT_EQ(simulation.quarantined(), 0u);
  }
}

}  // namespace
}  // namespace fulcrum::physics
