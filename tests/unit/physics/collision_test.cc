// Tools against tissue, and the tissue held by a grasper.
#include <gtest/gtest.h>

#include <utility>

#include "physics_node/simulation/tissue_simulation.h"
#include "services/scene/builder/build.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

constexpr std::uint32_t kRows = 25, kCols = 25;
constexpr float kH = 0.002f;
const Vec3f kMiddle(0.024f, 0.024f, 0.0f);

/// A tool that points straight down.
ToolPose Down(const Vec3f& tip, float jaw_rad = 0.9f) {
  return {tip, Quatf(Eigen::AngleAxisf(static_cast<float>(M_PI), Vec3f::UnitX())), jaw_rad};
}

std::array<ToolInput, kMaxTools> Only(int tool, const ToolPose& pose) {
  std::array<ToolInput, kMaxTools> tools;
  tools[static_cast<std::size_t>(tool)] = {true, pose};
  return tools;
}

class OnSheet : public testing::Test {
 protected:
  explicit OnSheet(float grip_force_N = PhysicsParams().grip_force_N) : data_(Sheet(grip_force_N)) {}
  static scene::SceneData Sheet(float grip_force_N) {
    scene::SceneData data = SheetScene(kRows, kCols, kH);
    data.fixed.physics.grip_force_N = grip_force_N;
    return data;
  }

  scene::SceneData data_;
  SceneView scene_ = data_.View();
  TissueSimulation simulation_{scene_};

  void Run(int tool, const ToolPose& pose, int steps) {
    for (int i = 0; i < steps; ++i) {
      simulation_.Step(Only(tool, pose));
    }
  }
  /// Moves straight from `from` to `to`.
  void Drive(int tool, const ToolPose& from, const ToolPose& to, int steps) {
    for (int i = 1; i <= steps; ++i) {
      simulation_.Step(Only(tool, Interpolate(from, to, static_cast<float>(i) / static_cast<float>(steps))));
    }
  }
  [[nodiscard]] Vec3f Node(Index row, Index col) const {
    return simulation_.particles().At(simulation_.particles().Ref(row * kCols + col));
  }
  [[nodiscard]] float Lowest() const {
    float z = 1;
    for (Index p = 0; p < kRows * kCols; ++p) {
      z = std::min(z, simulation_.particles().At(simulation_.particles().Ref(p)).z());
    }
    return z;
  }
  [[nodiscard]] float Highest() const {
    float z = -1;
    for (Index p = 0; p < kRows * kCols; ++p) {
      z = std::max(z, simulation_.particles().At(simulation_.particles().Ref(p)).z());
    }
    return z;
  }
};

TEST_F(OnSheet, BoundsFittedAtRestHoldFarFromWhereTheToolsWere) {
  ParticleStore particles(scene_);
  const TissueModel model(scene_, &particles);
  ToolCollision collision(scene_, &model, &particles);
  const auto motion = [&](const Vec3f& tip) {
    const ToolShape shape = ShapeOf(scene_.tools[1], Down(tip));
    return std::array<ToolCollision::ToolMotion, kMaxTools>{ToolCollision::ToolMotion{}, {shape, shape}};
  };
  // The sheet rises while the tool is far away, by more than the bounds assume for so few steps.
  const Vec3f away = kMiddle + Vec3f(0, 0, 0.3f), above = kMiddle + Vec3f(0, 0, 0.051f);
  for (int step = 0; step < 3; ++step) {
    for (Index p = 0; p < kRows * kCols; ++p) {
      const ParticleRef at = particles.Ref(p);
      particles.Set(at, scene_.rest_position[p] + Vec3f(0, 0, 0.05f));
      particles.SetPrevious(at, particles.At(at));
    }
    collision.FindPairs(motion(away), true);
  }
  collision.FitAtRest();
  collision.FindPairs(motion(above), false);
  EXPECT_FALSE(collision.pairs().empty());
}

TEST_F(OnSheet, HookDentsTheMembraneAndStaysInFront) {
  const ToolPose above = Down(kMiddle + Vec3f(0, 0, 0.01f)), pressed = Down(kMiddle - Vec3f(0, 0, 0.003f));
  Run(1, above, 5);
  EXPECT_FALSE(simulation_.collision().any_touching());
  Drive(1, above, pressed, 60);
  Run(1, pressed, 60);
  EXPECT_TRUE(simulation_.collision().any_touching());
  // The foot runs from the heel along +x of the tool, which is +x of the world here.
  const SurfacePoint nearest = simulation_.collision().Nearest(WorkingLine(scene_.tools[1], pressed), 0.01f);
  ASSERT_TRUE(nearest.found);
  EXPECT_LT(nearest.closest.on_triangle.z(), -0.003f);
  EXPECT_NEAR(nearest.gap, scene_.physics.collision_margin_m, 4e-4f);
  EXPECT_LT(Lowest(), -0.003f);
  EXPECT_GT(Lowest(), -0.006f);
  EXPECT_EQ(simulation_.quarantined(), 0u);
  // After the tool is removed the sheet is flat again.
  Drive(1, pressed, above, 30);
  Run(1, above, 400);
  EXPECT_GT(Lowest(), -3e-4f);
}

/// Cells of a footprint covered by the metal: their number, their middle and their extent, in cells.
struct Covered {
  double count = 0;
  Vec2f middle = Vec2f::Zero(), extent = Vec2f::Zero();
};
Covered CoveredBy(const Footprint& print) {
  Covered covered;
  Vec2f low = Vec2f::Constant(1e9f), high = -low;
  for (std::uint32_t n = 0; n < print.gap.size(); ++n) {
    if (Footprint::Decode(print.gap[n]) > 0.0f) continue;
    const Vec2f cell(static_cast<float>(print.x) + static_cast<float>(n % print.width) + 0.5f,
                     static_cast<float>(print.y) + static_cast<float>(n / print.width) + 0.5f);
    covered.count += 1;
    covered.middle += cell;
    low = low.cwiseMin(cell);
    high = high.cwiseMax(cell);
  }
  if (covered.count > 0) {
    covered.middle /= static_cast<float>(covered.count);
    covered.extent = high - low + Vec2f::Ones();
  }
  return covered;
}

TEST_F(OnSheet, TheFootprintOfPressedMetalLiesAlongIt) {
  const Vec3f place = kMiddle - Vec3f(0, 0, 0.002f);
  const auto pressed = [&](const Quatf& turn) {
    TissueSimulation simulation(scene_);
    const ToolPose down = Down(place), pose{place, turn * down.q_WT, 0};
    CauteryContact contact;
    for (int i = 0; i <= 150; ++i) {
      ToolPose now = pose;
      now.p_WT.z() += std::max(0.0f, 0.008f - 1e-4f * static_cast<float>(i));
      simulation.Step(Only(1, now));
      contact = simulation.Cautery(1);
      EXPECT_TRUE(contact.touching || contact.footprint.width == 0);
    }
    EXPECT_TRUE(contact.touching);
    EXPECT_FLOAT_EQ(contact.contact_radius_m, scene_.tools[1].tip_radius_m);
    return CoveredBy(contact.footprint);
  };
  const auto turned = [](float angle, const Vec3f& axis) { return Quatf(Eigen::AngleAxisf(angle, axis)); };
  const Covered lying = pressed(Quatf::Identity());
  EXPECT_GT(lying.extent.x(), 8);
  EXPECT_LT(lying.extent.y(), 0.6f * lying.extent.x());
  const Covered across = pressed(turned(static_cast<float>(M_PI / 2), Vec3f::UnitZ()));
  EXPECT_GT(across.extent.y(), 8);
  EXPECT_LT(across.extent.x(), 0.6f * across.extent.y());
  // The foot points up: only its heel touches.
  EXPECT_LT(pressed(turned(static_cast<float>(-M_PI / 3), Vec3f::UnitY())).count, 0.5 * lying.count);
}

/// Metal and a flat sheet that does not move.
class Still {
 public:
  explicit Still(const SceneView& scene)
      : scene_(scene),
        particles_(scene),
        model_(scene, &particles_),
        collision_(scene, &model_, &particles_),
        probe_(scene, &model_, &particles_) {}
  /// The foot passes through the middle of the sheet, slanted, `along` further along x and `across` along y.
  [[nodiscard]] CauteryContact Through(float slant_deg, float along = 0, float across = 0) {
    const float slant = slant_deg * static_cast<float>(M_PI) / 180;
    ToolPose pose = Down(kMiddle + Vec3f(along, across, lift_) + 0.0025f * Vec3f(-std::cos(slant), 0, std::sin(slant)));
    pose.q_WT = Quatf(Eigen::AngleAxisf(slant, Vec3f::UnitY())) * pose.q_WT;
    std::array<ToolCollision::ToolMotion, kMaxTools> motion;
    motion[1] = {ShapeOf(scene_.tools[1], pose), ShapeOf(scene_.tools[1], pose)};
    collision_.FindPairs(motion, true);
    return probe_.Update(1, pose, collision_, scene_.physics.dt_s);
  }
  /// Number of places of the sheet that the foot of the last Through() would push.
  [[nodiscard]] int Pushed() {
    std::vector<ContactRow> rows;
    collision_.Rows(0, 1, &rows);
    return static_cast<int>(std::count_if(rows.begin(), rows.end(), [&](const ContactRow& row) {
      Vec3f place = Vec3f::Zero();
      for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k) {
        place += row.weight[k] * particles_.At(row.at[k]);
      }
      return collision_.pairs()[row.source].capsule == kMaxCapsules && row.normal.dot(place) < row.offset;
    }));
  }
  [[nodiscard]] float MarginAt(Index triangle) const { return collision_.MarginAt(triangle, ToolPart::kTip); }
  void SetOpenCells(const OpenCells& open) { collision_.SetOpenCells(open); }
  /// Lifts the whole sheet, and the foot of the next Through() with it.
  void Lift(float height_m) {
    lift_ = height_m;
    std::vector<float> xyz(3 * std::size_t{particles_.particle_count()});
    particles_.CopyPositions(xyz);
    for (std::size_t node = 0; node < kRows * kCols; ++node) xyz[3 * node + 2] = height_m;
    particles_.SetAll(xyz, xyz);
  }
  /// Severs the edges from `row` to the next row and moves all rows beyond by `gap_m` in y.
  void Open(Index row, float gap_m) {
    TopologyState slit;
    slit.scene_hash = scene_.hash;
    slit.rows = kRows;
    slit.cols = kCols;
    slit.dead_nodes.assign((kRows * kCols + 7) / 8, 0);
    slit.dead_edges.assign((3 * kRows * kCols + 7) / 8, 0);
    slit.shrink.assign(3 * kRows * kCols, 0);
    for (Index node = row * kCols; node < (row + 1) * kCols; ++node) {
      SetBit(slit.dead_edges, 3 * node + 1);
      SetBit(slit.dead_edges, 3 * node + 2);
    }
    EXPECT_GT(model_.Apply(slit, &particles_), 0);
    std::vector<float> xyz(3 * std::size_t{particles_.particle_count()});
    particles_.CopyPositions(xyz);
    for (std::size_t node = (row + 1) * kCols; node < kRows * kCols; ++node) xyz[3 * node + 1] += gap_m;
    particles_.SetAll(xyz, xyz);
  }

 private:
  SceneView scene_;
  ParticleStore particles_;
  TissueModel model_;
  ToolCollision collision_;
  CauteryProbe probe_;
  float lift_ = 0;
};

/// A sheet more than 2 mm above the fat is tented: no current leaks and no heat sinks into the fat.
TEST_F(OnSheet, ALiftedSheetIsTented) {
  for (const auto& [height_m, tented] : {std::pair{0.0f, false}, {0.001f, false}, {0.003f, true}}) {
    Still still(scene_);
    still.Lift(height_m);
    const CauteryContact contact = still.Through(30);
    ASSERT_TRUE(contact.touching) << height_m;
    EXPECT_EQ(contact.tented, tented) << height_m;
  }
}

TEST_F(OnSheet, MetalThroughTheSheetCoversItsSection) {
  // Upright a disc; at 30 degrees to the sheet an ellipse, twice as long. A gap along the normal is reduced by half the
  // sheet's thickness and a twentieth of a millimetre, which lengthens the section of the slanted foot.
  const double radius = static_cast<double>(scene_.tools[1].tip_radius_m / scene_.thermal.cell_m),
               disc = M_PI * radius * radius;
  Still still(scene_);
  const Covered upright = CoveredBy(still.Through(90).footprint);
  EXPECT_NEAR(upright.count, disc, 0.04 * disc);
  EXPECT_NEAR(upright.extent.x(), 2 * radius, 1.01);
  EXPECT_NEAR(upright.extent.y(), 2 * radius, 1.01);
  EXPECT_LT((upright.middle * scene_.thermal.cell_m - Vec2f(kMiddle.x(), kMiddle.y())).norm(), scene_.thermal.cell_m);
  const Covered slanted = CoveredBy(Still(scene_).Through(30).footprint);
  const double cushion = static_cast<double>((0.5f * scene_.thermal.thickness_m + 5e-5f) / scene_.thermal.cell_m);
  EXPECT_NEAR(slanted.extent.x(), 2 * (2 * radius + std::sqrt(3) * cushion), 2.01);
  EXPECT_NEAR(slanted.extent.y(), 2 * radius, 1.01);
}

TEST_F(OnSheet, TheThicknessIsThatOfTheSheet) {
  SheetPart thick{"thick", 0, kRows, kCols, 0};
  thick.thickness_m = 2 * scene_.thermal.thickness_m;
  SceneView scene = scene_;
  scene.sheets = std::span(&thick, 1);
  Still still(scene);
  const Covered slanted = CoveredBy(still.Through(30).footprint);
  const double radius = static_cast<double>(scene_.tools[1].tip_radius_m / scene_.thermal.cell_m);
  const double cushion = static_cast<double>((0.5f * thick.thickness_m + 5e-5f) / scene_.thermal.cell_m);
  EXPECT_NEAR(slanted.extent.x(), 2 * (2 * radius + std::sqrt(3) * cushion), 2.01);
  EXPECT_GT(slanted.extent.x(), CoveredBy(Still(scene_).Through(30).footprint).extent.x() + 2);
  EXPECT_FLOAT_EQ(still.MarginAt(0), std::min(0.5f * thick.thickness_m, scene_.physics.collision_margin_m));
  EXPECT_FLOAT_EQ(still.MarginAt(kNoIndex), 0.5f * scene_.thermal.thickness_m);
  EXPECT_FLOAT_EQ(Still(scene_).MarginAt(0), 0.5f * scene_.thermal.thickness_m);
}

TEST_F(OnSheet, AFootprintMovesOnEvenly) {
  Still still(scene_);
  Covered before;
  for (int i = 0; i < 60; ++i) {
    const Covered now = CoveredBy(still.Through(80, 5e-5f * static_cast<float>(i)).footprint);
    ASSERT_GT(now.count, 0);
    if (i > 0) {
      EXPECT_LT((now.middle - before.middle).norm(), 0.8f) << i;
    }
    before = now;
  }
}

TEST_F(OnSheet, MetalInAnOpenGapIsAsFarFromBothLipsAsItIs) {
  // The lips are in the middle of the severed edges; the metal stands in the middle of the gap.
  constexpr Index kSevered = kRows / 2;
  constexpr float kAir_m = 3e-4f;
  const float gap_m = 2 * (scene_.tools[1].tip_radius_m + kAir_m);
  Still still(scene_);
  still.Open(kSevered, gap_m);
  const Footprint print = still.Through(90, 0, 0.5f * (kH + gap_m)).footprint;
  ASSERT_GT(print.width, 0u);
  const float least_m = Footprint::Decode(*std::min_element(print.gap.begin(), print.gap.end()));
  EXPECT_NEAR(least_m, kAir_m, scene_.thermal.cell_m);
  // On the lip it covers half of its section.
  const double radius = static_cast<double>(scene_.tools[1].tip_radius_m / scene_.thermal.cell_m),
               half = 0.5 * M_PI * radius * radius;
  EXPECT_NEAR(CoveredBy(still.Through(90, 0, 0.5f * kH).footprint).count, half, 0.15 * half);
}

TEST_F(OnSheet, MetalPushesOnlyWhatIsLeftOfATriangle) {
  // The cells in a box of 4 mm about the middle are removed, and no edge of the mesh is severed.
  OpenCells open;
  open.scene_hash = scene_.hash;
  open.x = static_cast<std::int32_t>(std::floor(kMiddle.x() / scene_.thermal.cell_m)) - kOpenWindow / 2;
  open.y = static_cast<std::int32_t>(std::floor(kMiddle.y() / scene_.thermal.cell_m)) - kOpenWindow / 2;
  for (std::size_t j = 12; j < 52; ++j) open.rows[j] = ((std::uint64_t{1} << 40) - 1) << 12;
  const auto pushed = [&](bool knows, float along_m) {
    Still still(scene_);
    if (knows) still.SetOpenCells(open);
    (void)still.Through(90, along_m);
    return still.Pushed();
  };
  EXPECT_GT(pushed(false, 0), 0);
  EXPECT_EQ(pushed(true, 0), 0);
  // The foot is 1.2 mm wide, and the rim is 2 mm away.
  EXPECT_EQ(pushed(true, 0.0013f), 0);
  EXPECT_GT(pushed(true, 0.0016f), 0);
  EXPECT_TRUE(simulation_.SetOpenCells(open));
  open.scene_hash ^= 1;
  EXPECT_FALSE(simulation_.SetOpenCells(open)) << "cells of another scene";
}

TEST_F(OnSheet, AThinToolAtFullSpeedDoesNotTunnel) {
  // 1 m/s: 10 mm a step with a foot of 0.6 mm radius and triangles of 2 mm.
  const ToolPose above = Down(kMiddle + Vec3f(0.0007f, 0.0004f, 0.015f));
  const ToolPose below = Down(kMiddle + Vec3f(0.0007f, 0.0004f, -0.010f));
  Run(1, above, 3);
  Drive(1, above, below, 3);
  Run(1, below, 20);
  EXPECT_LT(Lowest(), -0.0095f);  // The membrane is stretched in front of the foot.
}

TEST_F(OnSheet, HookFromBelowLifts) {
  ToolPose under = Down(kMiddle - Vec3f(0, 0, 0.01f));
  under.q_WT = Quatf::Identity();  // The shaft comes from below.
  TissueSimulation fresh(scene_);
  for (int i = 0; i < 60; ++i) {
    ToolPose pose = under;
    pose.p_WT.z() += 0.0003f * static_cast<float>(i);
    fresh.Step(Only(1, pose));
  }
  float highest = -1;
  for (Index p = 0; p < kRows * kCols; ++p) {
    highest = std::max(highest, fresh.particles().At(fresh.particles().Ref(p)).z());
  }
  EXPECT_GT(highest, 0.006f);
}

TEST_F(OnSheet, HolesDoNotCollide) {
  TopologyState hole;
  hole.scene_hash = scene_.hash;
  hole.rows = kRows;
  hole.cols = kCols;
  hole.dead_nodes.assign((kRows * kCols + 7) / 8, 0);
  hole.dead_edges.assign((3 * kRows * kCols + 7) / 8, 0);
  hole.shrink.assign(3 * kRows * kCols, 0);
  for (Index r = 6; r < 19; ++r) {
    for (Index c = 6; c < 19; ++c) {
      SetBit(hole.dead_nodes, r * kCols + c);
    }
  }
  EXPECT_GT(simulation_.ApplyTopology(hole), 0);
  const ToolPose above = Down(kMiddle + Vec3f(0, 0, 0.01f)), below = Down(kMiddle - Vec3f(0, 0, 0.008f));
  Run(1, above, 2);
  Drive(1, above, below, 40);
  EXPECT_FALSE(simulation_.collision().any_touching());
}

TEST_F(OnSheet, FrictionCarriesTheMembraneAlong) {
  const ToolPose above = Down(kMiddle + Vec3f(-0.006f, 0, 0.006f)),
                 pressed = Down(kMiddle + Vec3f(-0.006f, 0, -0.003f));
  ToolPose dragged = pressed;
  dragged.p_WT.x() += 0.01f;
  Run(1, above, 2);
  Drive(1, above, pressed, 30);
  const float before = Node(12, 10).x();
  Drive(1, pressed, dragged, 40);
  EXPECT_GT(Node(12, 10).x(), before + 2e-5f);
  EXPECT_EQ(simulation_.quarantined(), 0u);
}

class Grasping : public OnSheet {
 protected:
  using OnSheet::OnSheet;
  const ToolPose open_ = Down(kMiddle - Vec3f(0, 0, 0.001f), 0.9f);
  const ToolPose closed_ = Down(kMiddle - Vec3f(0, 0, 0.001f), 0.0f);

  void TakeHold() {
    Run(0, Down(kMiddle + Vec3f(0, 0, 0.01f), 0.9f), 2);
    Drive(0, Down(kMiddle + Vec3f(0, 0, 0.01f), 0.9f), open_, 30);
    for (int i = 1; i <= 20; ++i) {
      ToolPose pose = open_;
      pose.jaw_rad = 0.9f - 0.045f * static_cast<float>(i);
      simulation_.Step(Only(0, pose));
    }
    ASSERT_TRUE(simulation_.grasp(0).holding());
  }
};

TEST_F(Grasping, HoldsRigidlyAndLetsGo) {
  TakeHold();
  const auto held = simulation_.grasp(0).held();
  ASSERT_GT(held.size(), 3u);
  const ToolPose up = Down(kMiddle + Vec3f(0.002f, 0, 0.008f), 0.0f);
  Drive(0, closed_, up, 60);
  ASSERT_EQ(simulation_.grasp(0).held().size(), held.size());
  for (const HeldParticle& h : simulation_.grasp(0).held()) {
    const Vec3f at = simulation_.particles().At(simulation_.particles().Ref(h.particle));
    EXPECT_LT((at - up.ToWorld(h.p_T)).norm(), 1e-6f);
  }
  EXPECT_GT(Highest(), 0.004f);
  ToolPose opened = up;
  opened.jaw_rad = 0.9f;
  Drive(0, up, opened, 10);
  EXPECT_FALSE(simulation_.grasp(0).holding());
  Run(0, Down(kMiddle + Vec3f(0, 0, 0.05f), 0.9f), 500);
  EXPECT_LT(Highest(), 5e-4f);
  for (Index p = 0; p < kRows * kCols; ++p) {
    EXPECT_EQ(simulation_.particles().InverseMass(simulation_.particles().Ref(p)), scene_.inverse_mass[p]);
  }
}

TEST_F(Grasping, ClosedJawsDoNotPickUpWhatTheyMeetLater) {
  Run(0, Down(kMiddle + Vec3f(0, 0, 0.03f), 0.9f), 2);
  Run(0, Down(kMiddle + Vec3f(0, 0, 0.03f), 0.0f), 2);
  Drive(0, Down(kMiddle + Vec3f(0, 0, 0.03f), 0.0f), closed_, 40);
  EXPECT_FALSE(simulation_.grasp(0).holding());
  EXPECT_EQ(simulation_.grasp(0).state(), Grasp::State::kClosedEmpty);
}

class WeakGrasping : public Grasping {
 protected:
  WeakGrasping() : Grasping(1.5f) {}
};

TEST_F(WeakGrasping, SlipsWhenPulledTooHard) {
  TakeHold();
  const std::size_t before = simulation_.grasp(0).held().size();
  const ToolPose far = Down(kMiddle + Vec3f(0, 0, 0.04f), 0.0f);
  for (int i = 1; i <= 400; ++i) {
    simulation_.Step(Only(0, Interpolate(closed_, far, std::min(1.0f, static_cast<float>(i) / 100))));
    (void)simulation_.Contacts(0);
  }
  EXPECT_LT(simulation_.grasp(0).held().size(), before);
  EXPECT_LT(simulation_.force(0).norm(), 1.6f * scene_.physics.grip_force_N);
}

TEST_F(Grasping, WhatIsCutAwayIsNotHeld) {
  TakeHold();
  TopologyState cut;
  cut.scene_hash = scene_.hash;
  cut.rows = kRows;
  cut.cols = kCols;
  cut.dead_nodes.assign((kRows * kCols + 7) / 8, 0);
  cut.dead_edges.assign((3 * kRows * kCols + 7) / 8, 0);
  cut.shrink.assign(3 * kRows * kCols, 0);
  for (const HeldParticle& held : simulation_.grasp(0).held()) {
    SetBit(cut.dead_nodes, held.particle);
  }
  EXPECT_GT(simulation_.ApplyTopology(cut), 0);
  EXPECT_FALSE(simulation_.grasp(0).holding());
}

TEST(GraspLayers, JawsThatDoNotReachTheOrganTakeTheMembraneAlone) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  const SceneView scene = data.View();
  ParticleStore particles(scene);
  const TissueModel model(scene, &particles);
  Grasp grasp(scene);
  // Straight down through the membrane in the middle of the sheet; the organ is 4.5 mm beneath it.
  const Index middle = scene.membrane.first + 36 * 25 + 12;
  const Vec3f tip = scene.rest_position[middle] - Vec3f(0, 0, 0.002f);
  grasp.Update(scene.tools[0], Down(tip, 0.9f), model, &particles);
  grasp.Update(scene.tools[0], Down(tip, 0.0f), model, &particles);
  ASSERT_TRUE(grasp.holding());
  for (const HeldParticle& held : grasp.held()) {
    EXPECT_GE(held.particle, scene.membrane.first);
  }
}

}  // namespace
}  // namespace fulcrum::physics
