// The rasteriser against rays that are intersected with the same triangles.
#include "render_node/geometry/rasteriser.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace fulcrum::render {
namespace {

const Pinhole kCamera{.width = 64, .height = 48, .focal = 40, .centre_x = 32, .centre_y = 24, .radius = 38};

Vec3d RayOf(int x, int y) {
  return {(x + 0.5 - kCamera.centre_x) / kCamera.focal, (y + 0.5 - kCamera.centre_y) / kCamera.focal, -1};
}

/// Depth at which a ray meets a triangle; infinity: it misses.
double DepthOn(const Vec3d& ray, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  Eigen::Matrix3d m;
  m << b - a, c - a, -ray;
  if (std::abs(m.determinant()) < 1e-300) return std::numeric_limits<double>::infinity();
  const Vec3d u = m.inverse() * -a;  // a + u0 (b - a) + u1 (c - a) = u2 ray.
  const bool inside = u[0] >= 0 && u[1] >= 0 && u[0] + u[1] <= 1 && u[2] > 0.004;
  return inside ? u[2] : std::numeric_limits<double>::infinity();
}

TEST(Rasteriser, ShowsTheNearestOfRandomTriangles) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> side(-0.2, 0.2),
      ahead(-0.5, 0.1);  // Some pass the camera, some lie behind it.
  std::vector<Vec3d> corners;
  std::vector<Triangle> triangles;
  for (Index i = 0; i < 40; ++i) {
    for (int k = 0; k < 3; ++k) corners.emplace_back(side(random), side(random), ahead(random));
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  Rasteriser raster(kCamera);
  raster.Add(5, corners, triangles, {});
  int shown = 0;
  for (int y = 0; y < kCamera.height; ++y) {
    for (int x = 0; x < kCamera.width; ++x) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Triangle& t : triangles) {
        nearest = std::min(nearest, DepthOn(RayOf(x, y), corners[t[0]], corners[t[1]], corners[t[2]]));
      }
      const Hit& hit = raster.At(x, y);
      const bool in_field = kCamera.Shows({x + 0.5, y + 0.5});
      ASSERT_EQ(hit.any(), in_field && std::isfinite(nearest)) << x << " " << y;
      if (!hit.any()) continue;
      ++shown;
      EXPECT_NEAR(static_cast<double>(hit.depth_m), nearest, 1e-6);
      const Triangle& t = triangles[hit.triangle];
      const auto b1 = static_cast<double>(hit.b1), b2 = static_cast<double>(hit.b2);
      const Vec3d point = (1 - b1 - b2) * corners[t[0]] + b1 * corners[t[1]] + b2 * corners[t[2]];
      EXPECT_NEAR((point - nearest * RayOf(x, y)).norm(), 0, 1e-6);
    }
  }
  EXPECT_GT(shown, 1000);
}

/// A square at a depth, of two triangles that are counter-clockwise in the picture.
void AddSquare(std::int32_t surface, double depth, const RasterOptions& options, Rasteriser* raster,
               bool clockwise = false) {
  const double a = 2 * depth;
  const std::vector<Vec3d> corners{{-a, -a, -depth}, {a, -a, -depth}, {a, a, -depth}, {-a, a, -depth}};
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 2, 3}}, reversed{{0, 2, 1}, {0, 3, 2}};
  raster->Add(surface, corners, clockwise ? reversed : triangles, options);
}

TEST(Rasteriser, TwoTrianglesLeaveNoGapAndTheFieldIsRound) {
  Rasteriser raster(kCamera);
  AddSquare(1, 0.1, {}, &raster);
  for (int y = 0; y < kCamera.height; ++y) {
    for (int x = 0; x < kCamera.width; ++x) {
      EXPECT_EQ(raster.At(x, y).any(), kCamera.Shows({x + 0.5, y + 0.5})) << x << " " << y;
    }
  }
}

TEST(Rasteriser, HidesWhatIsTurnedAwayIsBehindOrIsNotShown) {
  Rasteriser raster(kCamera);
  AddSquare(1, 0.1, {.cull_back = true}, &raster, true);
  EXPECT_FALSE(raster.At(32, 24).any());
  AddSquare(2, 0.1, {.behind_m = 0.002}, &raster);
  EXPECT_EQ(raster.At(32, 24).surface, 2);
  AddSquare(3, 0.101, {}, &raster);
  EXPECT_EQ(raster.At(32, 24).surface, 3) << "the other counts as 2 mm farther";
  AddSquare(4, 0.05, {.shown = [](std::uint32_t, float, float) { return false; }}, &raster);
  EXPECT_EQ(raster.At(32, 24).surface, 3);
  EXPECT_FLOAT_EQ(raster.At(32, 24).depth_m, 0.101f);
}

TEST(Rasteriser, HasTheCameraOfThePicture) {
  RenderParams params;
  params.width = 96;
  params.height = 54;
  const Laparoscope scope = MakeLaparoscope(params);
  const Pinhole camera = PinholeOf(scope, 192, 108);  // Of a picture with twice as many lines.
  EXPECT_NEAR(camera.near_m, 0.004, 1e-8);
  EXPECT_NEAR(camera.radius, 2 * static_cast<double>(scope.circle_radius), 1e-4);
  const Vec3f p(0.01f, -0.02f, -0.1f);
  const Vec3f clip = (scope.projection * p.homogeneous()).hnormalized();
  const Vec2d place = camera.Project(p.cast<double>());
  EXPECT_NEAR(place.x(), 96 * (1 + static_cast<double>(clip.x())), 1e-3);
  EXPECT_NEAR(place.y(), 54 * (1 + static_cast<double>(clip.y())), 1e-3);
}

TEST(Rasteriser, TakesNoHarmFromInvalidTriangles) {
  Rasteriser raster(kCamera);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Vec3d> corners{{0, 0, -0.1}, {nan, 0, -0.1}, {0, 0.1, -0.1}, {0, 0, 0}, {1e300, 0, -1e300}};
  const std::vector<Triangle> triangles{{0, 1, 2}, {0, 0, 2}, {3, 3, 3}, {0, 2, 4}};
  raster.Add(1, corners, triangles, {});
  for (const Hit& hit : raster.hits()) EXPECT_TRUE(!hit.any() || std::isfinite(hit.depth_m));
}

}  // namespace
}  // namespace fulcrum::render
