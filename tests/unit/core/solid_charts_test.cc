// Charts of the solids' surface: every triangle is in one, lengths are kept, and no cell belongs to two places.
#include "services/base/core/solid_charts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace fulcrum {
namespace {

struct Surface {
  std::vector<Vec3f> vertices;
  std::vector<Triangle> triangles;

  [[nodiscard]] TissueScene View() const {
    TissueScene scene;
    scene.rest_position = vertices;
    scene.tube_surface = triangles;
    return scene;
  }
};

/// A sphere of rings and segments.
Surface Sphere(float radius_m, Index rings, Index segments) {
  Surface s;
  s.vertices.push_back({0, 0, radius_m});
  for (Index r = 1; r < rings; ++r) {
    for (Index k = 0; k < segments; ++k) {
      const float polar = std::numbers::pi_v<float> * static_cast<float>(r) / static_cast<float>(rings);
      const float around = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / static_cast<float>(segments);
      s.vertices.push_back(
          radius_m * Vec3f(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), std::cos(polar)));
    }
  }
  s.vertices.push_back({0, 0, -radius_m});
  const auto at = [&](Index r, Index k) { return 1 + (r - 1) * segments + k % segments; };
  for (Index k = 0; k < segments; ++k) {
    s.triangles.push_back({0, at(1, k), at(1, k + 1)});
    for (Index r = 1; r + 1 < rings; ++r) {
      s.triangles.push_back({at(r, k), at(r + 1, k), at(r + 1, k + 1)});
      s.triangles.push_back({at(r, k), at(r + 1, k + 1), at(r, k + 1)});
    }
    s.triangles.push_back({at(rings - 1, k), static_cast<Index>(s.vertices.size() - 1), at(rings - 1, k + 1)});
  }
  return s;
}

/// A plate of squares in the plane z = 0.
Surface Plate(float width_m, float height_m, Index columns, Index rows) {
  Surface s;
  for (Index r = 0; r <= rows; ++r) {
    for (Index c = 0; c <= columns; ++c) {
      s.vertices.push_back({width_m * static_cast<float>(c) / static_cast<float>(columns),
                            height_m * static_cast<float>(r) / static_cast<float>(rows), 0});
    }
  }
  for (Index r = 0; r < rows; ++r) {
    for (Index c = 0; c < columns; ++c) {
      const Index a = r * (columns + 1) + c, b = a + columns + 1;
      s.triangles.push_back({a, a + 1, b + 1});
      s.triangles.push_back({a, b + 1, b});
    }
  }
  return s;
}

std::array<Vec2f, 3> MaterialOf(const Surface& surface, const SolidCharts& charts, Index triangle) {
  const SolidChart& chart = charts.charts[charts.of_triangle[triangle]];
  std::array<Vec2f, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = chart.Material(surface.vertices[surface.triangles[triangle][k]]);
  return corners;
}

TEST(SolidCharts, CoverASphereWithoutOverlap) {
  const Surface surface = Sphere(0.03f, 40, 80);
  const SolidCharts charts = MakeSolidCharts(surface.View());
  ASSERT_EQ(charts.of_triangle.size(), surface.triangles.size());
  EXPECT_LT(charts.charts.size(), 60u);
  std::map<std::pair<int, int>, Index> cells;
  for (Index t = 0; t < surface.triangles.size(); ++t) {
    const Index chart = charts.of_triangle[t];
    ASSERT_LT(chart, charts.charts.size());
    const SolidChart& box = charts.charts[chart];
    const auto corners = MaterialOf(surface, charts, t);
    const auto& v = surface.triangles[t];
    const Vec3f normal = (surface.vertices[v[1]] - surface.vertices[v[0]])
                             .cross(surface.vertices[v[2]] - surface.vertices[v[0]])
                             .normalized();
    EXPECT_GE(normal.dot(box.normal()), 0.64f);
    // Seen from outside, s and t are right-handed.
    const Vec2f a = corners[1] - corners[0], b = corners[2] - corners[0];
    EXPECT_GT(a.x() * b.y() - a.y() * b.x(), 0.0f);
    for (const Vec2f& p : corners) {
      const int x = static_cast<int>(std::floor(p.x() / kSolidCell_m));
      const int y = static_cast<int>(std::floor(p.y() / kSolidCell_m));
      EXPECT_TRUE(x >= box.x - 1 && x <= box.x + box.width && y >= box.y - 1 && y <= box.y + box.height);
      EXPECT_TRUE(x >= 0 && y >= 0 && x < charts.width && y < charts.height);
      const auto [known, added] = cells.try_emplace({x, y}, chart);
      EXPECT_TRUE(added || known->second == chart) << x << " " << y;
    }
  }
  for (std::size_t a = 0; a < charts.charts.size(); ++a) {
    EXPECT_LE(charts.charts[a].width, 203);  // 40 mm.
    for (std::size_t b = 0; b < a; ++b) {
      const SolidChart &p = charts.charts[a], &q = charts.charts[b];
      const bool apart = p.x + p.width < q.x || q.x + q.width < p.x || p.y + p.height < q.y || q.y + q.height < p.y;
      EXPECT_TRUE(apart) << a << " " << b;
    }
  }
}

TEST(SolidCharts, KeepLengthsOfAPlate) {
  const Surface surface = Plate(0.03f, 0.02f, 12, 8);
  const SolidCharts charts = MakeSolidCharts(surface.View());
  ASSERT_EQ(charts.charts.size(), 1u);
  for (Index t = 0; t < surface.triangles.size(); ++t) {
    const auto corners = MaterialOf(surface, charts, t);
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3f& a = surface.vertices[surface.triangles[t][k]];
      const Vec3f& b = surface.vertices[surface.triangles[t][(k + 1) % 3]];
      EXPECT_NEAR((corners[k] - corners[(k + 1) % 3]).norm(), (a - b).norm(), 1e-7f);
    }
  }
}

/// A ramp that winds about the z axis and comes to lie over its own beginning.
TEST(SolidCharts, DoNotOverlapThemselves) {
  Surface ramp;
  constexpr Index kSteps = 160;
  for (Index k = 0; k <= kSteps; ++k) {
    const float turn = 2 * std::numbers::pi_v<float> * 1.6f * static_cast<float>(k) / kSteps;
    for (const float radius : {0.004f, 0.012f}) {
      ramp.vertices.push_back({radius * std::cos(turn), radius * std::sin(turn), 0.008f / 6.2832f * turn});
    }
  }
  for (Index k = 0; k < kSteps; ++k) {
    ramp.triangles.push_back({2 * k, 2 * k + 1, 2 * k + 3});
    ramp.triangles.push_back({2 * k, 2 * k + 3, 2 * k + 2});
  }
  const SolidCharts charts = MakeSolidCharts(ramp.View());
  EXPECT_GE(charts.charts.size(), 2u);
  std::map<std::pair<int, int>, int> covered;
  for (Index t = 0; t < ramp.triangles.size(); ++t) {
    const auto p = MaterialOf(ramp, charts, t);
    const Vec2f e1 = p[1] - p[0], e2 = p[2] - p[0];
    const float area = e1.x() * e2.y() - e1.y() * e2.x();
    for (int y = 0; y < charts.height; ++y) {
      for (int x = 0; x < charts.width; ++x) {
        const Vec2f d = kSolidCell_m * Vec2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - p[0];
        const float u = (d.x() * e2.y() - d.y() * e2.x()) / area, v = (e1.x() * d.y() - e1.y() * d.x()) / area;
        if (u > 0.05f && v > 0.05f && u + v < 0.95f) ++covered[{x, y}];
      }
    }
  }
  const auto twice = std::count_if(covered.begin(), covered.end(), [](const auto& cell) { return cell.second > 1; });
  EXPECT_EQ(twice, 0);
}

TEST(SolidCharts, LeaveOutWhatTheAtlasCannotHold) {
  const Surface surface = Plate(1.2f, 1.2f, 40, 40);  // 36 million texels of 16.8.
  const SolidCharts charts = MakeSolidCharts(surface.View());
  EXPECT_LE(charts.width, kAtlasTexels);
  EXPECT_LE(charts.height, kAtlasTexels);
  const auto left_out = std::count(charts.of_triangle.begin(), charts.of_triangle.end(), kNoIndex);
  EXPECT_GT(left_out, 0);
  EXPECT_LT(left_out, static_cast<std::ptrdiff_t>(surface.triangles.size()));
  // No chart without a place claims texels of another one.
  for (Index t = 0; t < surface.triangles.size(); ++t) {
    if (charts.of_triangle[t] == kNoIndex) continue;
    const SolidChart& own = charts.charts[charts.of_triangle[t]];
    const auto holders = std::count_if(charts.charts.begin(), charts.charts.end(),
                                       [&](const SolidChart& chart) { return chart.Contains(own.x, own.y); });
    ASSERT_EQ(holders, 1) << t;
  }
}

TEST(SolidCharts, BearTrianglesWithoutAreaAndEdgesOfThree) {
  Surface surface = Plate(0.01f, 0.01f, 2, 2);
  surface.triangles.push_back({0, 1, 1});
  surface.triangles.push_back({0, 0, 0});
  surface.triangles.push_back({0, 1, 4});  // A third triangle at an edge.
  const SolidCharts charts = MakeSolidCharts(surface.View());
  EXPECT_EQ(charts.of_triangle.size(), surface.triangles.size());
  for (const SolidChart& chart : charts.charts) {
    EXPECT_TRUE(chart.shift.allFinite());
    EXPECT_NEAR(chart.normal().norm(), 1.0f, 1e-5f);
  }
  EXPECT_TRUE(MakeSolidCharts(TissueScene{}).empty());
}

}  // namespace
}  // namespace fulcrum
