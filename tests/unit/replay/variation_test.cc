// Variations of a scope that looks steeply down from the patient's side.
#include "services/apps/replayer/variation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render_node/geometry/laparoscope.h"

namespace fulcrum::replay {
namespace {

TEST(Variation, TurnsThePictureNoMoreThanItsScopeAndItsRoll) {
  SceneView scene;
  scene.render.scope_tip_W = Vec3f(0.06f, 0, 0.1f);
  scene.render.scope_target_W = Vec3f::Zero();
  const auto up = [](const RenderParams& camera) {
    return Vec3d(render::MakeLaparoscope(camera).view.block<1, 3>(1, 0).transpose().cast<double>());
  };
  const double most_rad = (12 + 10 * std::sqrt(2) + 1) * std::numbers::pi / 180;
  bool varied = false;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const Vec3d turned = up(VariationOf(scene, 1, i).camera);
    const double angle_rad = std::acos(std::clamp(turned.dot(up(scene.render)), -1.0, 1.0));
    EXPECT_LE(angle_rad, most_rad) << i;
    varied = varied || angle_rad > 0.1;
  }
  EXPECT_TRUE(varied);
}

}  // namespace
}  // namespace fulcrum::replay
