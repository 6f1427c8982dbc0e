// Membrane against organ, both against fixed surroundings, and surroundings that breathe.
#include "physics_node/collision/tissue_collision.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

#include "physics_node/collision/closest.h"
#include "physics_node/collision/row_projection.h"
#include "physics_node/pbd/pbd_solver.h"
#include "services/base/core/breathing.h"
#include "services/scene/builder/build.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

/// A sheet 2 mm above a fixed floor that extends beyond it and faces up.
scene::SceneData SheetOverFloor(float below = 0.002f) {
  scene::SceneData data = SheetScene(17, 17);
  StaticSurface floor{};
  std::strncpy(floor.name, "floor", sizeof(floor.name) - 1);
  floor.role = SurfaceRole::kRetroperitoneum;
  floor.vertex_count = 4;
  floor.triangle_count = 2;
  floor.collides = 1;
  data.static_surfaces = {floor};
  data.static_vertices = {Vec3f(-0.01f, -0.01f, -below), Vec3f(0.05f, -0.01f, -below), Vec3f(0.05f, 0.05f, -below),
                          Vec3f(-0.01f, 0.05f, -below)};
  data.static_triangles = {{0, 1, 2}, {0, 2, 3}};
  return data;
}

struct World {
  explicit World(const SceneView& view)
      : scene(view),
        particles(scene),
        model(scene, &particles),
        solver(scene.physics, &model, &particles),
        collision(scene, &model, &particles) {}
  void Step() {
    particles.MeasureMoves(&moved);
    const double next = time + scene.physics.dt_s;
    collision.FindPairs(moved, time, next);
    time = next;
    rows.clear();
    collision.Rows(0, 1, &rows);
    solver.Predict();
    for (int i = 0; i < 4; ++i) {
      solver.Iterate();
      ProjectRows(rows, 0.001f, scene.physics.dt_s, &particles);
    }
    solver.Finish();
  }
  [[nodiscard]] Vec3f Node(Index node) const { return particles.At(particles.Ref(scene.membrane.first + node)); }

  SceneView scene;
  ParticleStore particles;
  TissueModel model;
  PbdSolver solver;
  TissueCollision collision;
  std::vector<float> moved;
  std::vector<ContactRow> rows;
  double time = 0;
};

TEST(TriangleTree, FindsTheNearestLikeASearch) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> at(-1, 1);
  const auto point = [&] { return Vec3f(at(random), at(random), at(random)); };
  std::vector<std::array<Vec3f, 3>> triangles;
  for (int i = 0; i < 300; ++i) {
    const Vec3f p = point();
    triangles.push_back({p, p + 0.1f * point(), p + 0.1f * point()});
  }
  const TriangleTree tree(triangles);
  for (int i = 0; i < 200; ++i) {
    const Vec3f p = point();
    float best = 1e9f;
    for (const auto& t : triangles) {
      const auto b = ClosestOnTriangle(p, t[0], t[1], t[2]);
      best = std::min(best, (p - b[0] * t[0] - b[1] * t[1] - b[2] * t[2]).squaredNorm());
    }
    EXPECT_NEAR(tree.Nearest(p, 10).distance_sq, best, 1e-6f);
    EXPECT_EQ(tree.Nearest(p, 0.5f * std::sqrt(best)).triangle, kNoIndex);
    EXPECT_EQ(tree.Nearest(p, 10, static_cast<Index>(i)).triangle, tree.Nearest(p, 10).triangle)
        << "for any initial guess";
  }
  EXPECT_EQ(TriangleTree().Nearest(point(), 1).triangle, kNoIndex);
}

TEST(TissueCollision, AFallingSheetComesToRestOnTheFloor) {
  const scene::SceneData data = SheetOverFloor();
  SceneView scene = data.View();
  scene.physics.gravity = Vec3f(0, 0, -9.81f);
  scene.physics.k_stretch_membrane = 0.05f;  // A soft membrane that would sag far below the floor.
  World world(scene);
  for (int i = 0; i < 200; ++i) {
    world.Step();
    ASSERT_LE(world.rows.size(), TissueCollision::kMaxRows);
  }
  float lowest = 1;
  for (Index n = 0; n < scene.membrane.node_count(); ++n) {
    lowest = std::min(lowest, world.Node(n).z());
  }
  EXPECT_NEAR(lowest, -0.002f + scene.physics.collision_margin_m, 2e-4f);
  EXPECT_GT(world.collision.near_count(), 20u);
}

TEST(TissueCollision, SeenFromBehindAFixedSurfaceIsNoContact) {
  const scene::SceneData data = SheetOverFloor(-0.002f);  // The floor is above the sheet and faces away from it.
  World world(data.View());
  for (int i = 0; i < 20; ++i) {
    world.Step();
    EXPECT_TRUE(world.rows.empty());
  }
}

/// The search for fast tissue reaches farther; a surface out of that reach gives no direction of contact.
TEST(TissueCollision, FastTissueOutOfSightOfTheFloorIsNoContact) {
  const scene::SceneData data = SheetOverFloor(0.05f);
  World world(data.View());
  const std::vector<float> fast(world.particles.block_count(), 0.02f);
  world.collision.FindPairs(fast, 0, 0.01);
  world.collision.Rows(0, 1, &world.rows);
  EXPECT_TRUE(world.rows.empty());
}

/// At rest the floor is out of reach: the side of a node is determined when it comes near.
TEST(TissueCollision, WhatComesFromAfarIsHeldInFrontAndLeftAloneBehind) {
  for (const float below : {0.03f, -0.03f}) {
    const scene::SceneData data = SheetOverFloor(below);
    World world(data.View());
    const ParticleRef at = world.particles.Ref(world.scene.membrane.first + 8 * 17 + 8);
    const auto move_to = [&](float z) {
      Vec3f p = world.particles.At(at);
      p.z() = z;
      world.particles.SetPrevious(at, world.particles.At(at));
      world.particles.Set(at, p);
      world.particles.MeasureMoves(&world.moved);
      world.collision.FindPairs(world.moved, 0, 0);
      world.rows.clear();
      world.collision.Rows(0, 1, &world.rows);
    };
    const float side = below > 0 ? 1.0f : -1.0f;
    for (int mm = 0; mm < 27; ++mm) {
      ASSERT_TRUE(world.rows.empty()) << mm << " mm on the way to " << -below;
      move_to(-side * 0.001f * static_cast<float>(mm));
    }
    move_to(-below + side * 0.0001f);
    if (below < 0) {
      EXPECT_TRUE(world.rows.empty()) << "the node is behind the floor";
      continue;
    }
    ASSERT_EQ(world.rows.size(), 1u);
    EXPECT_EQ(world.rows[0].at[0].base, at.base);
    EXPECT_GT(world.rows[0].normal.z(), 0.99f);
  }
}

/// A floor under one half of the sheet; a node of the other half is moved down beside it and then beneath it.
TEST(TissueCollision, WhatGoesRoundTheRimIsNotThrownUpFromBeneath) {
  scene::SceneData data = SheetOverFloor();
  for (Vec3f& p : data.static_vertices) {
    p.x() = std::min(p.x(), 0.016f);
  }
  World world(data.View());
  const Index node = 8 * 17 + 9;  // 2 mm past the rim.
  const ParticleRef at = world.particles.Ref(world.scene.membrane.first + node);
  const auto move_to = [&](const Vec3f& p) {
    world.particles.SetPrevious(at, world.particles.At(at));
    world.particles.Set(at, p);
    world.particles.MeasureMoves(&world.moved);
    world.collision.FindPairs(world.moved, 0, 0);
    world.rows.clear();
    world.collision.Rows(0, 1, &world.rows);
    return std::any_of(world.rows.begin(), world.rows.end(),
                       [&](const ContactRow& row) { return row.at[0].base == at.base; });
  };
  const float y = world.Node(node).y();
  EXPECT_TRUE(move_to(Vec3f(0.0150f, y, -0.0014f))) << "on the floor";
  for (const auto& [x, z] : {std::pair{0.0165f, -0.0016f},
                             {0.0172f, -0.0022f},
                             {0.0172f, -0.0030f},
                             {0.0165f, -0.0034f},
                             {0.0158f, -0.0034f},
                             {0.0150f, -0.0032f}}) {
    (void)move_to(Vec3f(x, y, z));
  }
  EXPECT_FALSE(move_to(Vec3f(0.0150f, y, -0.0030f))) << "beneath it";
  EXPECT_FALSE(move_to(Vec3f(0.0150f, y, -0.0022f))) << "beneath it and close";
}

TEST(TissueCollision, TheOrganUnderThePeritoneumIsFreeToRise) {
  const scene::SceneData data = scene::BuildProcedural(scene::BuiltIn());
  World world(data.View());
  for (int i = 0; i < 10; ++i) {
    for (Index v = 0; v < world.scene.tube_vertex_count; ++v) {
      const ParticleRef at{4 * v, 1};
      world.particles.SetPrevious(at, world.particles.At(at));
      world.particles.Set(at, world.particles.At(at) + Vec3f(0, 0, 0.001f));
    }
    world.particles.MeasureMoves(&world.moved);
    world.collision.FindPairs(world.moved, 0, 0);
    world.rows.clear();
    world.collision.Rows(0, 1, &world.rows);
    for (const ContactRow& row : world.rows) {
      EXPECT_FALSE(row.count == 1 && row.at[0].step == 1) << "step " << i;  // An organ vertex against a fixed surface.
    }
  }
}

TEST(TissueCollision, RestCostsNothing) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  World world(data.View());
  const std::vector<float> still(world.particles.block_count(), 0.0f);
  world.collision.FindPairs(still, 0, 0.01);
  EXPECT_LE(world.collision.evaluated_count(), world.collision.near_count() + 20u)
      << "near particles are known from the start";
  world.collision.FindPairs(still, 0.01, 0.02);
  EXPECT_LE(world.collision.evaluated_count(), world.collision.near_count() + 20u);
  // One block moves a little: only those of its particles that are near a surface are evaluated.
  std::vector<float> moved = still;
  moved.back() = 0.0001f;
  world.collision.FindPairs(moved, 0.02, 0.03);
  EXPECT_LE(world.collision.evaluated_count(), world.collision.near_count() + ParticleStore::kBlockVertices + 20u);
}

TEST(TissueCollision, TheRestShapeHasNoForce) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  World world(data.View());
  world.particles.MeasureMoves(&world.moved);
  world.collision.FindPairs(world.moved, 0, 0.01);
  world.collision.Rows(0, 1, &world.rows);
  for (const ContactRow& row : world.rows) {
    float gap = -row.offset;
    for (int k = 0; k < row.count; ++k) {
      const auto j = static_cast<std::size_t>(k);
      gap += row.weight[j] * row.normal.dot(world.particles.At(row.at[j]));
    }
    ASSERT_GE(gap, -1e-6f);
  }
}

/// Free membrane nodes inside the organ.
int CountInside(const World& world) {
  int inside = 0;
  for (Index n = 0; n < world.scene.membrane.node_count(); ++n) {
    const ParticleRef at = world.particles.Ref(world.scene.membrane.first + n);
    const Vec3f p = world.particles.At(at);
    float best = 1e9f;
    bool behind = false;
    for (const Triangle& t : world.scene.tube_surface) {
      const Vec3f a = world.particles.At({4 * t[0], 1}), b = world.particles.At({4 * t[1], 1}),
                  c = world.particles.At({4 * t[2], 1});
      const auto w = ClosestOnTriangle(p, a, b, c);
      const Vec3f offset = p - w[0] * a - w[1] * b - w[2] * c;
      if (offset.squaredNorm() < best) {
        best = offset.squaredNorm();
        behind = (b - a).cross(c - a).dot(offset) < 0.0f;
      }
    }
    inside += behind && best > 1e-8f && world.particles.InverseMass(at) > 0.0f;
  }
  return inside;
}

TEST(TissueCollision, TheMembraneStaysOutsideTheOrgan) {
  scene::SceneData data = scene::BuildProcedural(scene::Small());
  data.bindings.clear();  // They would keep the membrane away, too.
  data.binding_colours = {0};
  World world(data.View());
  // The middle of the membrane is thrown down onto the organ.
  const Index cols = world.scene.membrane.cols;
  int near = 0;
  for (int i = 0; i < 40; ++i) {
    if (i < 6) {
      for (Index r = 30; r < 43; ++r) {
        for (Index c = 8; c < 17; ++c) {
          const ParticleRef at = world.particles.Ref(world.scene.membrane.first + r * cols + c);
          world.particles.SetPrevious(at, world.particles.At(at) + Vec3f(0, 0, 0.003f));
        }
      }
    }
    world.Step();
    near = std::max(near, static_cast<int>(world.rows.size()));
    if (i % 3 == 0) {
      ASSERT_EQ(CountInside(world), 0) << "step " << i;
    }
  }
  EXPECT_GT(near, 20);
}

/// No previous search is needed: for moving tissue the possible partners are known from the start.
TEST(TissueCollision, AnOrganThatComesToAMembraneAtRestIsSeen) {
  const scene::SceneData data = scene::BuildProcedural(scene::Small());
  World world(data.View());
  std::set<std::uint32_t> touched;
  for (int i = 0; i < 40; ++i) {
    for (Index vertex = 0; vertex < world.scene.tube_vertex_count; ++vertex) {
      const ParticleRef at = world.particles.Ref(vertex);
      world.particles.SetPrevious(at, world.particles.At(at));
      world.particles.Set(at, world.particles.At(at) + Vec3f(0, 0, 0.0002f));
    }
    world.particles.MeasureMoves(&world.moved);
    world.collision.FindPairs(world.moved, world.time, world.time);
    world.rows.clear();
    world.collision.Rows(0, 1, &world.rows);
    for (const ContactRow& row : world.rows) {
      if (row.at[0].step != 1) touched.insert(row.at[0].base);
    }
  }
  const int inside = CountInside(world);
  EXPECT_GT(inside, 50) << "the organ has passed through";
  EXPECT_GE(static_cast<int>(touched.size()), inside) << "each of them had a contact on the way";
}

TEST(TissueCollision, BreathingIsSmoothAndCarriesTheTissue) {
  const Breathing breathing{Vec3f::UnitZ(), 0.004f, 4.0f};
  EXPECT_EQ(BreathingOffset({}, 1.0), Vec3f(Vec3f::Zero()));
  EXPECT_NEAR(BreathingOffset(breathing, 0.0).z(), 0.0f, 1e-9f);
  EXPECT_NEAR(BreathingOffset(breathing, 1.0).z(), 0.002f, 1e-7f);
  EXPECT_NEAR(BreathingOffset(breathing, 2.0).z(), 0.004f, 1e-7f);
  EXPECT_NEAR(BreathingOffset(breathing, 8.0).z(), 0.0f, 1e-7f);
  EXPECT_FALSE(Breathes(SurfaceRole::kPelvis));
  EXPECT_FALSE(Breathes(SurfaceRole::kRetroperitoneum));
  EXPECT_TRUE(Breathes(SurfaceRole::kAbdominalWall));
  scene::SceneData data = SheetOverFloor();
  data.static_surfaces[0].role = SurfaceRole::kOther;
  data.fixed.breathing = breathing;
  World world(data.View());
  const Index middle = 8 * 17 + 8;
  float highest = -1;
  for (int i = 0; i < 400; ++i) {
    world.Step();
    highest = std::max(highest, world.Node(middle).z());
  }
  // The floor rises to 2 mm above the sheet's rest position and sinks again.
  EXPECT_GT(highest, 0.0018f);
  EXPECT_LT(highest, 0.0035f);
  EXPECT_LT(world.Node(middle).z(), 0.001f);
}

}  // namespace
}  // namespace fulcrum::physics
