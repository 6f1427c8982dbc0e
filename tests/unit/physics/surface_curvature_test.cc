// Principal curvatures at a contact: on shapes with known curvatures, with noise, with a border, with invalid
// triangles.
#include "physics_node/contact_model/surface_curvature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "services/scene/builder/build.h"
#include "tests/unit/physics/sheet_scene.h"

namespace fulcrum::physics {
namespace {

constexpr std::uint32_t kRows = 25, kCols = 25;
constexpr float kH = 0.001f;

/// A sheet bent to a height over (x, y), both relative to the middle [m].
struct Bent {
  explicit Bent(const std::function<float(float, float)>& height, float noise = 0, float tilt = 0)
      : data(SheetScene(kRows, kCols, kH)) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> off(-noise, noise);
    const float middle = 0.5f * kH * static_cast<float>(kCols - 1);
    const Quatf turn(Eigen::AngleAxisf(tilt, Vec3f(0.6f, 0.8f, 0)));
    for (Vec3f& p : data.rest_position) {
      const float x = p.x() - middle, y = p.y() - middle;
      p = turn * Vec3f(x, y, height(x, y) + off(random));
    }
    normal = turn * Vec3f::UnitZ();
    along_x = turn * Vec3f::UnitX();
  }
  /// Curvatures at a triangle of cell (row, col).
  [[nodiscard]] PrincipalCurvatures At(Index row, Index col, bool from_above = true) const {
    const SceneView scene = data.View();
    ParticleStore particles(scene);
    const TissueModel model(scene, &particles);
    SurfaceCurvature curvature(scene, &model, &particles);
    return curvature.At(Point(row, col), false, from_above ? normal : Vec3f(-normal));
  }
  [[nodiscard]] static SurfacePoint Point(Index row, Index col) {
    SurfacePoint point;
    point.found = true;
    point.triangle = 2 * (row * (kCols - 1) + col);
    point.closest.barycentric = {1, 0, 0};
    return point;
  }
  scene::SceneData data;
  Vec3f normal, along_x;
};

float Sphere(float x, float y, float radius) { return std::sqrt(radius * radius - x * x - y * y); }

TEST(SurfaceCurvature, OfAPlaneIsZero) {
  for (const float tilt : {0.0f, 0.7f}) {
    const PrincipalCurvatures found = Bent([](float, float) { return 0.0f; }, 0, tilt).At(12, 12);
    EXPECT_NEAR(found.kappa1, 0.0f, 0.01f);
    EXPECT_NEAR(found.kappa2, 0.0f, 0.01f);
  }
}

TEST(SurfaceCurvature, OfASphereIsThatOfItsRadiusAndConcaveFromWithin) {
  for (const float radius : {0.015f, 0.03f, 0.1f}) {
    const Bent bent([=](float x, float y) { return Sphere(x, y, 1.5f * radius); }, 0, 0.4f);
    const float expected = 1 / (1.5f * radius);
    for (const float sign : {1.0f, -1.0f}) {
      const PrincipalCurvatures found = bent.At(12, 12, sign > 0);
      EXPECT_NEAR(sign * found.kappa1, expected, 0.03f * expected) << radius;
      EXPECT_NEAR(sign * found.kappa2, expected, 0.03f * expected) << radius;
    }
  }
}

TEST(SurfaceCurvature, OfACylinderPointsAcrossIt) {
  constexpr float kAngle = 0.5f, kRadius = 0.02f;
  const Bent bent([](float x, float y) { return Sphere(std::cos(kAngle) * x + std::sin(kAngle) * y, 0, kRadius); });
  const PrincipalCurvatures found = bent.At(12, 12);
  EXPECT_NEAR(found.kappa1, 50.0f, 1.5f);
  EXPECT_NEAR(found.kappa2, 0.0f, 0.5f);
  EXPECT_GT(std::abs(found.e1.dot(Vec3f(std::cos(kAngle), std::sin(kAngle), 0))), 0.999f);
  EXPECT_NEAR(found.e1.dot(bent.normal), 0.0f, 1e-5f);
}

TEST(SurfaceCurvature, OfASaddleHasBothSigns) {
  const PrincipalCurvatures found = Bent([](float x, float y) { return -30 * x * x + 20 * y * y; }).At(12, 12);
  EXPECT_NEAR(found.kappa1, 60.0f, 2.0f);
  EXPECT_NEAR(found.kappa2, -40.0f, 2.0f);
  EXPECT_GT(std::abs(found.e1.x()), 0.999f);
}

TEST(SurfaceCurvature, LooksThroughNoise) {
  // Noise of ± 0.05 mm, on a mesh of 1 mm.
  const Bent bent([](float x, float) { return Sphere(x, 0, 0.02f); }, 5e-5f);
  double error = 0;
  int count = 0;
  for (Index row = 8; row < 16; ++row) {
    const PrincipalCurvatures found = bent.At(row, 12);
    error += std::pow(found.kappa1 - 50.0f, 2) + std::pow(found.kappa2, 2);
    count += 2;
  }
  EXPECT_LT(std::sqrt(error / count), 5.0);
}

TEST(SurfaceCurvature, OfABorderIsThatOfTheSideThatIsThere) {
  const Bent bent([](float x, float y) { return Sphere(x, y, 0.03f); });
  for (const auto& [row, col] : {std::pair{0u, 12u}, {12u, 0u}, {23u, 12u}}) {
    // The mean normal of the sheet, not that of the border; the fit corrects it.
    const PrincipalCurvatures found = bent.At(row, col);
    EXPECT_NEAR(found.kappa1, 33.3f, 5.0f) << row << ' ' << col;
    EXPECT_NEAR(found.kappa2, 33.3f, 5.0f) << row << ' ' << col;
  }
}

TEST(SurfaceCurvature, ACutPartsWhatLiesBesideIt) {
  // A right-angled fold along column 12, at which the sheet is cut: each side is flat.
  const Bent bent([](float x, float) { return x > 0.0005f ? 0.004f : 0.0f; });
  const SceneView scene = bent.data.View();
  ParticleStore particles(scene);
  TissueModel model(scene, &particles);
  SurfaceCurvature curvature(scene, &model, &particles);
  EXPECT_GT(std::abs(curvature.At(Bent::Point(12, 10), false, bent.normal).kappa1), 20.0f);
  TopologyState slit;
  slit.rows = kRows;
  slit.cols = kCols;
  slit.dead_nodes.assign((kRows * kCols + 7) / 8, 0);
  slit.dead_edges.assign((3 * kRows * kCols + 7) / 8, 0);
  slit.shrink.assign(3 * kRows * kCols, 0);
  for (Index r = 0; r < kRows; ++r) {
    SetBit(slit.dead_edges, 3 * (r * kCols + 12));
    SetBit(slit.dead_edges, 3 * (r * kCols + 12) + 2);
  }
  ASSERT_GT(model.Apply(slit, &particles), 0);
  EXPECT_LT(std::abs(curvature.At(Bent::Point(12, 10), false, bent.normal).kappa1), 0.1f);
}

TEST(SurfaceCurvature, OfWhatIsNoSurfaceIsZero) {
  for (const auto& shrink : {Vec3f(0, 0, 0), Vec3f(1, 0, 0), Vec3f(1e-20f, 1e-20f, 0), Vec3f(1e18f, 1e18f, 1)}) {
    Bent bent([](float x, float y) { return 3 * x * y; });
    for (Vec3f& p : bent.data.rest_position) {
      p = p.cwiseProduct(shrink);
    }
    const PrincipalCurvatures found = bent.At(12, 12);
    EXPECT_TRUE(found.e1.allFinite());
    EXPECT_NEAR(found.e1.norm(), 1.0f, 1e-4f);
    EXPECT_NEAR(found.kappa1, 0.0f, 1e-3f);
    EXPECT_NEAR(found.kappa2, 0.0f, 1e-3f);
  }
  // Invalid points, too few points, all points on a line, all points on a cross.
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Vec3f> broken(20, Vec3f(nan, 0, 0));
  EXPECT_EQ(FitCurvatures(broken, 0.006f, Vec3f::UnitZ()).kappa1, 0.0f);
  EXPECT_EQ(FitCurvatures({}, 0.006f, Vec3f::UnitZ()).kappa1, 0.0f);
  std::vector<Vec3f> line, cross;
  for (int i = -5; i <= 5; ++i) {
    const float s = 0.001f * static_cast<float>(i);
    line.emplace_back(s, 0, 30 * s * s);
    cross.emplace_back(s, 0, 30 * s * s);
    cross.emplace_back(0, s, 30 * s * s);
  }
  EXPECT_EQ(FitCurvatures(line, 0.006f, Vec3f::UnitZ()).kappa1, 0.0f);
  EXPECT_EQ(FitCurvatures(cross, 0.006f, Vec3f::UnitZ()).kappa1, 0.0f);
  // A normal that does not belong to the surface.
  const Bent bent([](float x, float y) { return Sphere(x, y, 0.03f); });
  const SceneView scene = bent.data.View();
  ParticleStore particles(scene);
  const TissueModel model(scene, &particles);
  SurfaceCurvature curvature(scene, &model, &particles);
  EXPECT_EQ(curvature.At(Bent::Point(12, 12), false, Vec3f::UnitX()).kappa1, 0.0f);
  EXPECT_EQ(curvature.At({}, false, Vec3f::UnitZ()).kappa1, 0.0f);
}

TEST(SurfaceCurvature, IsBounded) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> somewhere(-1, 1);
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<Vec3f> points(12);
    const float size = std::pow(10.0f, -6 * somewhere(random));
    for (Vec3f& p : points) {
      p = 0.005f * Vec3f(somewhere(random), somewhere(random), size * somewhere(random));
    }
    const PrincipalCurvatures found =
        RolledOver(FitCurvatures(points, 0.006f, Vec3f(0.6f, 0, 0.8f)), 0.002f * (1 + somewhere(random)));
    ASSERT_LE(std::abs(found.kappa1), kMaxCurvature);
    ASSERT_LE(std::abs(found.kappa2), kMaxCurvature);
    ASSERT_NEAR(found.e1.norm(), 1.0f, 1e-4f);
  }
}

TEST(SurfaceCurvature, OfTheOrganIsThatOfATube) {
  // A straight tube without folds: convex outside, concave inside.
  scene::SceneSettings settings = scene::Small();
  settings.tube.fold_depth_m = 0;
  const scene::SceneData data = scene::BuildProcedural(settings);
  const SceneView scene = data.View();
  ParticleStore particles(scene);
  const TissueModel model(scene, &particles);
  SurfaceCurvature curvature(scene, &model, &particles);
  std::vector<float> convex, concave;
  for (Index t = 0; t < scene.tube_surface.size(); ++t) {
    const auto& [a, b, c] = scene.tube_surface[t];
    const Vec3f n = (scene.rest_position[b] - scene.rest_position[a])
                        .cross(scene.rest_position[c] - scene.rest_position[a])
                        .normalized();
    SurfacePoint point;
    point.found = true;
    point.on_membrane = false;
    point.triangle = scene.membrane.triangle_count() + t;
    point.closest.barycentric = {1.0f / 3, 1.0f / 3, 1.0f / 3};
    const PrincipalCurvatures found = curvature.At(point, true, n);
    ASSERT_TRUE(found.e1.allFinite());
    ASSERT_NEAR(found.e1.dot(n), 0.0f, 1e-3f);
    (found.kappa1 > 0 ? convex : concave).push_back(found.kappa1);
  }
  const auto median = [](std::vector<float>* values) {
    const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
    std::nth_element(values->begin(), middle, values->end());
    return static_cast<double>(*middle);
  };
  // About ten segments: the quadric through their corners is curved slightly more.
  const double outer = 1 / settings.tube.outer_radius_m,
               inner = 1 / (settings.tube.outer_radius_m - settings.tube.wall_m);
  EXPECT_NEAR(median(&convex), outer, 0.15 * outer);
  EXPECT_LT(median(&concave), -0.5 * inner);
  EXPECT_GT(median(&concave), -1.5 * inner);
}

TEST(RolledOver, IsTheCurvatureOfTheParallelSurface) {
  PrincipalCurvatures surface;
  surface.kappa1 = 100;
  surface.kappa2 = -100;
  const PrincipalCurvatures rolled = RolledOver(surface, 0.002f);
  EXPECT_NEAR(rolled.kappa1, 1 / 0.012f, 1e-3f);
  EXPECT_NEAR(rolled.kappa2, -1 / 0.008f, 1e-3f);
}

}  // namespace
}  // namespace fulcrum::physics
