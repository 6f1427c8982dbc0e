#include "render_node/geometry/instrument_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace fulcrum::render {
namespace {

constexpr Index kSides = 24;

/// A closed tube of 2 mm radius from z = -100 mm to z = 0 in two sections, as a hook's mesh, preceded by a vertex and a
/// triangle of another mesh.
class InstrumentMeshTest : public testing::Test {
 protected:
  InstrumentMeshTest() {
    vertices_.emplace_back(9, 9, 9);
    triangles_.push_back({0, 0, 0});
    for (const float z : {-0.1f, -0.01f, 0.0f}) {
      for (Index k = 0; k < kSides; ++k) {
        const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / kSides;
        vertices_.emplace_back(0.002f * std::cos(angle), 0.002f * std::sin(angle), z);
      }
    }
    for (const Index ring : {0u, 1u}) {
      for (Index k = 0; k < kSides; ++k) {
        const Index a = 1 + ring * kSides + k, b = 1 + ring * kSides + (k + 1) % kSides;
        triangles_.push_back({a, b, b + kSides});
        triangles_.push_back({a, b + kSides, a + kSides});
      }
    }
    for (Index k = 1; k + 1 < kSides; ++k) {  // The cap at z = 0.
      triangles_.push_back({1 + 2 * kSides, 1 + 2 * kSides + k, 2 + 2 * kSides + k});
    }
    triangles_.push_back({1, 1, 2});  // Without area.
    scene_.tool_vertices = vertices_;
    scene_.tool_triangles = triangles_;
    scene_.tools[1].kind = ToolKind::kHook;
  }

  [[nodiscard]] Solid Make() const {
    return InstrumentSolid(scene_, {1, ToolPart::kBody, 1, static_cast<Index>(vertices_.size()) - 1, 1,
                                    static_cast<Index>(triangles_.size()) - 1});
  }

  std::vector<Vec3f> vertices_;
  std::vector<Triangle> triangles_;
  SceneView scene_;
};

TEST_F(InstrumentMeshTest, IsSmoothRoundTheTubeAndSharpAtItsEnd) {
  const Solid solid = Make();
  ASSERT_EQ(solid.triangles.size(), 5 * kSides - 2);
  for (std::size_t i = 0; i < solid.positions.size(); ++i) {
    const Vec3f& n = solid.normals[i];
    EXPECT_NEAR(n.norm(), 1, 1e-5f);
    if (i >= 3 * 4 * kSides) {
      EXPECT_NEAR(n.z(), 1, 1e-5f) << "the cap";
    } else {
      const Vec3f out = Vec3f(solid.positions[i].x(), solid.positions[i].y(), 0).normalized();
      EXPECT_GT(n.dot(out), 0.995f) << "between the faces' normals, which lie 15 degrees apart";
    }
  }
}

TEST_F(InstrumentMeshTest, IsInsulatedBehindAndBareAtTheTip) {
  const Solid solid = Make();
  EXPECT_LT(solid.colours.front()[3], 0.5f);
  EXPECT_EQ(solid.colours.back()[3], 1.0f);
}

}  // namespace
}  // namespace fulcrum::render
