// Contact rows of the tools: separation, strength and number.
#include <gtest/gtest.h>

#include <tuple>

#include "services/scene/builder/build.h"
#include "tests/unit/physics/row_player.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

constexpr std::uint32_t kRows = 25, kCols = 25;
constexpr float kH = 0.002f;
const Vec3f kMiddle(0.024f, 0.024f, 0.0f);

ToolPose Down(const Vec3f& tip, float about_z = 0, float tilt = 0) {
  const auto turn = [](float angle, const Vec3f& axis) { return Quatf(Eigen::AngleAxisf(angle, axis)); };
  return {tip,
          turn(about_z, Vec3f::UnitZ()) * turn(tilt, Vec3f::UnitY()) * turn(static_cast<float>(M_PI), Vec3f::UnitX()),
          0.9f};
}

/// Height of the membrane above the tool's capsule axis that is furthest below it: negative if the whole membrane is in
/// front.
float HighestOver(const SceneView& scene, const ParticleStore& particles, const Capsule& capsule) {
  float over = -1;
  for (Index p = 0; p < scene.membrane.node_count(); ++p) {
    const Vec3f x = particles.At(particles.Ref(p));
    const Vec3f nearest = capsule.a + ClosestOnSegment(x, capsule.a, capsule.b) * (capsule.b - capsule.a);
    if ((x - nearest).head<2>().norm() < capsule.radius) {
      over = std::max(over, x.z() - nearest.z());
    }
  }
  return over;
}

TEST(ContactRows, NothingTunnelsAtOneMetrePerSecond) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  const SceneView scene = data.View();
  for (int trial = 0; trial < 24; ++trial) {
    // Various places within a cell, and the foot in various directions, also tilted.
    const float a = static_cast<float>(trial);
    const Vec3f shift(0.0021f * std::sin(3.7f * a), 0.0021f * std::cos(5.1f * a), 0.003f * std::sin(2.3f * a));
    const float about_z = 0.9f * a, tilt = 0.5f * std::sin(1.3f * a);
    RowPlayer player(scene);
    const auto at = [&](float height) { return Down(kMiddle + shift + Vec3f(0, 0, height), about_z, tilt); };
    float height = 0.016f;
    player.Step(1, at(height));
    while (height > -0.010f) {
      height -= 0.010f;
      player.Step(1, at(height));
    }
    for (int i = 0; i < 10; ++i) {
      player.Step(1, at(height));
    }
    const Capsule foot = WorkingLine(scene.tools[1], at(height));
    EXPECT_LT(HighestOver(scene, player.particles(), foot), 0.0f) << "trial " << trial;
  }
}

TEST(ContactRows, TissueThatFliesAtAToolIsHeldUp) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  SceneView scene = data.View();
  for (const float speed : {0.3f, 1.0f}) {
    for (int trial = 0; trial < 6; ++trial) {
      RowPlayer player(scene);
      const Vec3f shift(0.0003f * static_cast<float>(trial), 0.0005f * static_cast<float>(trial), 0);
      const ToolPose pose = Down(kMiddle + shift + Vec3f(0, 0, 0.004f), 0.7f * static_cast<float>(trial));
      player.Step(1, pose);
      ParticleStore& particles = player.particles();
      for (Index r = 8; r < 17; ++r) {
        for (Index c = 8; c < 17; ++c) {
          const ParticleRef at = particles.Ref(r * kCols + c);
          particles.SetPrevious(at, particles.At(at) - Vec3f(0, 0, speed * 0.005f));
        }
      }
      for (int i = 0; i < 12; ++i) {
        player.Step(1, pose);
      }
      EXPECT_LT(HighestOver(scene, particles, WorkingLine(scene.tools[1], pose)), 0.0f)
          << "speed " << speed << " trial " << trial;
    }
  }
}

TEST(ContactRows, FrictionStaysInItsCone) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  const SceneView scene = data.View();
  RowPlayer player(scene);
  ParticleStore& particles = player.particles();
  const ParticleRef node = particles.NodeRef(12, 12);
  ContactRow row;
  row.count = 1;
  row.at[0] = node;
  row.weight[0] = 1;
  row.offset = 0.001f;
  row.friction = 0.3f;
  const Vec3f start = particles.At(node);
  for (const float drift : {0.0001f, 0.01f}) {
    particles.Set(node, start);
    particles.SetPrevious(node, start);
    row.drift = Vec3f(drift, 0, 0);
    EXPECT_EQ(ProjectRows({&row, 1}, 0.01f, 0.01f, &particles), 1u);
    const Vec3f moved = particles.At(node) - start;
    EXPECT_NEAR(moved.z(), 0.001f, 1e-6f);
    EXPECT_NEAR(moved.x(), std::min(drift, 0.3f * 0.001f), 1e-7f);  // Sticks within the cone, slides on it.
    EXPECT_NEAR(moved.y(), 0.0f, 1e-7f);
  }
}

TEST(ContactRows, AreCompleteFewAndCalm) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  const SceneView scene = data.View();
  RowPlayer player(scene);
  std::vector<ContactRow> rows;
  std::size_t most = 0;
  for (int i = 0; i < 80; ++i) {
    const float height = 0.010f - 0.0003f * static_cast<float>(std::min(i, 45));
    player.Step(0, Down(kMiddle + Vec3f(0, 0, height)), [&](const std::vector<ContactRow>& now) {
      most = std::max(most, now.size());
      for (const ContactRow& row : now) {
        ASSERT_GE(row.count, 1);
        ASSERT_LE(row.count, 3);
        float sum = 0, depth = row.offset;
        for (int k = 0; k < row.count; ++k) {
          const auto j = static_cast<std::size_t>(k);
          sum += row.weight[j];
          depth -= row.weight[j] * row.normal.dot(player.particles().At(row.at[j]));
        }
        ASSERT_NEAR(sum, 1.0f, 1e-5f);
        ASSERT_NEAR(row.normal.norm(), 1.0f, 1e-4f);
        // At most the tool's own motion and the limit of a push.
        ASSERT_LE(depth, ToolCollision::kMaxPush + std::max(0.0f, row.normal.dot(row.drift)) + 1e-6f);
        ASSERT_EQ(row.force_N, 0.0f);
        ASSERT_LT(row.source, player.tools().pairs().size());
      }
    });
  }
  EXPECT_GT(most, 3u);
  EXPECT_LE(most, kMaxTools * ToolCollision::kMaxRows);
}

TEST(ContactRows, ATeleportingToolAsksForLittle) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  const SceneView scene = data.View();
  RowPlayer player(scene);
  player.Step(0, Down(kMiddle + Vec3f(0, 0, 0.1f)));
  // The whole tool passes through the sheet in one step.
  player.Step(0, Down(kMiddle - Vec3f(0, 0, 0.02f)), [&](const std::vector<ContactRow>& rows) {
    EXPECT_LE(rows.size(), kMaxTools * ToolCollision::kMaxRows);
    for (const ContactRow& row : rows) {
      EXPECT_TRUE(row.normal.allFinite());
      EXPECT_TRUE(std::isfinite(row.offset));
    }
  });
  for (int i = 0; i < 100; ++i) {
    player.Step(0, Down(kMiddle + Vec3f(0, 0, 0.1f)));
  }
  for (Index p = 0; p < scene.membrane.node_count(); ++p) {
    EXPECT_LT((player.particles().At(player.particles().Ref(p)) - scene.rest_position[p]).norm(), 0.01f);
  }
}

TEST(ContactRows, NoneOnDeadNodes) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  const SceneView scene = data.View();
  RowPlayer player(scene);
  TopologyState hole;
  hole.rows = kRows;
  hole.cols = kCols;
  hole.dead_nodes.assign((kRows * kCols + 7) / 8, 0);
  hole.dead_edges.assign((3 * kRows * kCols + 7) / 8, 0);
  hole.shrink.assign(3 * kRows * kCols, 0);
  std::vector<std::uint32_t> dead;
  for (Index r = 11; r < 14; ++r) {
    for (Index c = 11; c < 14; ++c) {
      SetBit(hole.dead_nodes, r * kCols + c);
      dead.push_back(player.particles().NodeRef(r, c).base);
    }
  }
  ASSERT_GT(player.model().Apply(hole, &player.particles()), 0);
  std::size_t seen = 0;
  for (int i = 0; i < 60; ++i) {
    const float height = 0.006f - 0.0002f * static_cast<float>(i);
    player.Step(0, Down(kMiddle + Vec3f(0, 0, height)), [&](const std::vector<ContactRow>& rows) {
      seen += rows.size();
      for (const ContactRow& row : rows) {
        for (int k = 0; k < row.count; ++k) {
          EXPECT_EQ(std::count(dead.begin(), dead.end(), row.at[static_cast<std::size_t>(k)].base), 0);
        }
      }
    });
  }
  EXPECT_GT(seen, 0u);
}

/// Sixteen millimetres along y, one cell wide: right of the nodes of column 12.
TopologyState Slit() {
  TopologyState slit;
  slit.rows = kRows;
  slit.cols = kCols;
  slit.dead_nodes.assign((kRows * kCols + 7) / 8, 0);
  slit.dead_edges.assign((3 * kRows * kCols + 7) / 8, 0);
  slit.shrink.assign(3 * kRows * kCols, 0);
  for (Index r = 8; r < 17; ++r) {
    SetBit(slit.dead_edges, 3 * (r * kCols + 12));
    SetBit(slit.dead_edges, 3 * (r * kCols + 12) + 2);
  }
  return slit;
}

TEST(ContactRows, AFlapThatLiesOverAToolIsNotPulledThroughIt) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  RowPlayer player(data.View());
  ASSERT_GT(player.model().Apply(Slit(), &player.particles()), 0);
  // The foot lies along the slit on its left border, which folds back over it.
  const auto foot = [](float height) { return Down(Vec3f(0.0205f, 0.022f, height), static_cast<float>(M_PI) / 2); };
  for (const float height : {0.0012f, 0.0008f, 0.0004f}) {
    player.Step(1, foot(height));
  }
  for (std::uint32_t r = 10; r < 15; ++r) {
    for (const auto& [col, x, z] : {std::tuple{11u, 0.0221f, 0.0006f}, {12u, 0.0202f, 0.0014f}}) {
      const Vec3f place(x, kH * static_cast<float>(r), z);
      player.particles().Set(player.particles().NodeRef(r, col), place);
      player.particles().SetPrevious(player.particles().NodeRef(r, col), place);
    }
  }
  int over = 0;
  bool first = true;
  player.Step(1, foot(0.0004f), [&](const std::vector<ContactRow>& rows) {
    for (const ContactRow& row : rows) {
      const ContactPair& pair = player.tools().pairs()[row.source];
      if (first && pair.closest.on_triangle.z() > pair.closest.on_segment.z()) {
        EXPECT_GT(row.normal.dot(pair.closest.on_triangle - pair.closest.on_segment), 0.0f);
        ++over;
      }
    }
    first = false;
  });
  EXPECT_GT(over, 3);
}

TEST(ContactRows, AHookGoesThroughASlitAndComesBack) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  const SceneView scene = data.View();
  RowPlayer player(scene);
  ASSERT_GT(player.model().Apply(Slit(), &player.particles()), 0);
  const float along = static_cast<float>(M_PI) / 2;
  const Vec3f heel = kMiddle + Vec3f(0.001f, -0.002f, 0);
  const auto move = [&](float from, float to, float about_z0, float about_z1) {
    for (int i = 1; i <= 40; ++i) {
      const float u = static_cast<float>(i) / 40;
      player.Step(1, Down(heel + Vec3f(0, 0, from + u * (to - from)), about_z0 + u * (about_z1 - about_z0)));
    }
  };
  const auto lifted = [&] {
    float most = 0;
    for (Index p = 0; p < scene.membrane.node_count(); ++p) {
      most = std::max(most, std::abs(player.particles().At(player.particles().Ref(p)).z()));
    }
    return most;
  };
  // The foot along the slit moves in and out.
  move(0.006f, -0.004f, along, along);
  EXPECT_LT(lifted(), 0.001f);
  move(-0.004f, 0.008f, along, along);
  EXPECT_LT(lifted(), 0.001f);
  // Turned across the slit beneath the sheet, the foot hooks the sheet; turned back, it releases it.
  move(0.008f, -0.004f, along, along);
  move(-0.004f, -0.004f, along, 0);
  move(-0.004f, 0.004f, 0, 0);
  EXPECT_GT(lifted(), 0.002f);
  move(0.004f, -0.004f, 0, 0);
  move(-0.004f, -0.004f, 0, along);
  move(-0.004f, 0.008f, along, along);
  for (int i = 0; i < 100; ++i) {
    player.Step(1, Down(heel + Vec3f(0, 0, 0.008f), along));
  }
  EXPECT_LT(lifted(), 0.001f);
}

TEST(ContactRows, ForcesOfTheRowsAreThatOnTheTool) {
  const scene::SceneData data = SheetScene(kRows, kCols, kH);
  const SceneView scene = data.View();
  RowPlayer player(scene);
  for (int i = 0; i < 40; ++i) {
    player.Step(1, Down(kMiddle + Vec3f(0, 0, 0.006f - 0.0002f * static_cast<float>(i))));
  }
  std::vector<ContactRow>& rows = player.rows();
  ASSERT_FALSE(rows.empty());
  Vec3f sum = Vec3f::Zero();
  for (ContactRow& row : rows) {
    row.force_N = 0.25f;
    row.friction_N = Vec3f(0.01f, 0, 0);
    sum += 0.25f * row.normal + row.friction_N;
  }
  player.tools().TakeForces(rows);
  EXPECT_LT((player.tools().force(1) + sum).norm(), 1e-5f);
  EXPECT_GT(player.tools().force(1).z(), 0.0f);  // The tissue pushes up.
  EXPECT_TRUE(player.tools().any_touching());
  EXPECT_EQ(player.tools().force(0), Vec3f(Vec3f::Zero()));
  player.tools().TakeForces({});
  EXPECT_FALSE(player.tools().any_touching());
}

}  // namespace
}  // namespace fulcrum::physics
