#include "render_node/geometry/laparoscope.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render_node/geometry/camera_control.h"
#include "render_node/geometry/solid.h"
#include "render_node/geometry/tissue_pattern.h"

namespace fulcrum::render {
namespace {

Vec3f ToClip(const Laparoscope& scope, const Vec3f& p_W) {
  const Eigen::Vector4f clip = scope.projection * scope.view * p_W.homogeneous();
  return clip.hnormalized();
}

TEST(LaparoscopeTest, TheTargetIsInTheMiddleAndCranialIsUp) {
  RenderParams params;
  params.scope_tip_W = Vec3f(0.01f, -0.08f, 0.09f);
  params.scope_target_W = Vec3f(0, 0.01f, 0.02f);
  const Laparoscope scope = MakeLaparoscope(params);
  const Vec3f target = ToClip(scope, params.scope_target_W);
  EXPECT_NEAR(target.x(), 0, 1e-5f);
  EXPECT_NEAR(target.y(), 0, 1e-5f);
  EXPECT_GT(target.z(), -1);
  EXPECT_LT(target.z(), 1);
  EXPECT_GT(ToClip(scope, params.scope_target_W + Vec3f(0, 0.01f, 0)).y(), 0);
  EXPECT_GT(ToClip(scope, params.scope_target_W + Vec3f(0.01f, 0, 0)).x(), 0);
}

TEST(LaparoscopeTest, TheFieldOfViewSpansTheHeight) {
  RenderParams params;
  params.scope_tip_W = Vec3f(0, 0, 0.1f);
  params.scope_target_W = Vec3f::Zero();
  params.fov_deg = 60;
  const Laparoscope scope = MakeLaparoscope(params);
  const float half = 0.1f * std::tan(0.5235988f);
  EXPECT_NEAR(ToClip(scope, Vec3f(0, half, 0)).y(), 1, 1e-4f);
  EXPECT_NEAR(ToClip(scope, Vec3f(half * 960 / 540, 0, 0)).x(), 1, 1e-4f);
}

TEST(LaparoscopeTest, TheHorizonRollsClockwise) {
  RenderParams params;
  params.scope_tip_W = Vec3f(0, -0.08f, 0.09f);
  params.roll_deg = 90;
  const Laparoscope scope = MakeLaparoscope(params);
  EXPECT_GT(ToClip(scope, Vec3f(0, 0, 0.01f)).x(), 0.01f) << "the former up is on the right";
  EXPECT_NEAR(ToClip(scope, Vec3f(0, 0, 0.01f)).y(), 0, 1e-5f);
}

TEST(StereoEyesTest, DisparityIsThatOfParallelCamerasThatMeetAtTheConvergence) {
  RenderParams params;
  params.scope_tip_W = Vec3f(0.01f, -0.08f, 0.09f);
  params.scope_target_W = Vec3f(0, 0.01f, 0.02f);
  params.roll_deg = 20;
  const Laparoscope scope = MakeLaparoscope(params);
  const Mat3f turn = scope.view.block<3, 3>(0, 0).transpose();
  for (const float given_m : {0.0f, 0.07f}) {
    const StereoParams stereo{StereoLayout::kSideBySide, 0.005f, given_m};
    const float convergence_m = given_m > 0 ? given_m : (params.scope_target_W - params.scope_tip_W).norm();
    const std::vector<Laparoscope> eyes = MakeEyes(params, stereo);
    ASSERT_EQ(eyes.size(), 2u);
    EXPECT_NEAR((EyeOf(eyes[1]) - EyeOf(eyes[0])).norm(), 0.005f, 1e-7f);
    EXPECT_LT((0.5f * (EyeOf(eyes[0]) + EyeOf(eyes[1])) - params.scope_tip_W).norm(), 1e-7f);
    for (const float depth_m : {0.01f, 0.05f, convergence_m, 0.2f}) {
      const Vec3f p_W = EyeOf(scope) + turn * Vec3f(0.1f * depth_m, -0.2f * depth_m, -depth_m);
      const Vec3f left = ToClip(eyes[0], p_W), right = ToClip(eyes[1], p_W), middle = ToClip(scope, p_W);
      const float disparity = scope.projection(0, 0) * 0.005f * (1 / depth_m - 1 / convergence_m);
      EXPECT_NEAR(left.x() - right.x(), disparity, 1e-4f) << depth_m;
      EXPECT_NEAR(0.5f * (left.x() + right.x()), middle.x(), 1e-4f) << depth_m;
      EXPECT_NEAR(left.y(), middle.y(), 1e-4f);
      EXPECT_NEAR(right.y(), middle.y(), 1e-4f);
    }
    // One light for both.
    const Vec3f in_left = EyeOf(eyes[0]) + turn * eyes[0].light_position;
    EXPECT_LT((EyeOf(eyes[1]) + turn * eyes[1].light_position - in_left).norm(), 1e-7f);
    EXPECT_LT((EyeOf(scope) + turn * scope.light_position - in_left).norm(), 1e-7f);
  }
}

TEST(StereoEyesTest, WithoutStereoThereIsTheScopesOwnCamera) {
  RenderParams params;
  params.scope_tip_W = Vec3f(0.01f, -0.08f, 0.09f);
  const std::vector<Laparoscope> eyes = MakeEyes(params, {});
  ASSERT_EQ(eyes.size(), 1u);
  EXPECT_EQ(eyes[0].view, MakeLaparoscope(params).view);
  EXPECT_EQ(eyes[0].projection, MakeLaparoscope(params).projection);
  EXPECT_EQ(eyes[0].light_position, MakeLaparoscope(params).light_position);
}

TEST(CameraControlTest, TurnsAboutTheTargetAndComesBack) {
  RenderParams scene;
  scene.scope_tip_W = Vec3f(0.004f, -0.06f, 0.08f);
  scene.scope_target_W = Vec3f(0, 0.002f, 0.02f);
  CameraControl camera(scene);
  const float distance = (scene.scope_tip_W - scene.scope_target_W).norm();
  for (const CameraKey key : {CameraKey::kLeft, CameraKey::kUp, CameraKey::kRight, CameraKey::kDown}) {
    for (int k = 0; k < 60; ++k) {
      camera.Press(key);
      const Vec3f out = camera.params().scope_tip_W - camera.params().scope_target_W;
      EXPECT_NEAR(out.norm(), distance, 1e-4f);
      EXPECT_LT(std::abs(out.normalized().z()), 0.98f) << "never straight down, where up is undefined";
    }
  }
  for (int k = 0; k < 100; ++k) {
    camera.Press(CameraKey::kNearer);
  }
  EXPECT_NEAR((camera.params().scope_tip_W - camera.params().scope_target_W).norm(), 0.02f, 1e-4f);
  camera.Follow(Vec3f(0.01f, 0, 0.03f));
  EXPECT_EQ(camera.params().scope_target_W, Vec3f(0.01f, 0, 0.03f));
  camera.Press(CameraKey::kReset);
  EXPECT_EQ(camera.params().scope_tip_W, scene.scope_tip_W);
  EXPECT_EQ(camera.params().scope_target_W, scene.scope_target_W);
}

TEST(CameraControlTest, NoKeyTurnsThePictureByMuchMoreThanTheScope) {
  // From the patient's side, 59 degrees down: "up" of a level picture becomes cranial on the way up.
  RenderParams scene;
  scene.scope_tip_W = Vec3f(0.06f, 0, 0.1f);
  scene.scope_target_W = Vec3f::Zero();
  CameraControl camera(scene);
  const auto view = [&] { return Mat3f(MakeLaparoscope(camera.params()).view.topLeftCorner<3, 3>()); };
  const Mat3f first = view();
  for (const auto& [key, times] : {std::pair{CameraKey::kUp, 5}, {CameraKey::kLeft, 20}, {CameraKey::kDown, 5}}) {
    for (int k = 0; k < times; ++k) {
      const Mat3f before = view();
      camera.Press(key);
      const Eigen::AngleAxisf turn(Mat3f(view() * before.transpose()));
      EXPECT_NEAR(turn.angle(), RadiansOf(3), 1e-3f) << k;
    }
  }
  for (int k = 0; k < 20; ++k) camera.Press(CameraKey::kRight);
  EXPECT_LT((view() - first).norm(), 1e-3f) << "back where it was, and level";
}

TEST(LaparoscopeTest, LightIsOneAtTheTargetAndLeavesBetweenSightAndShaft) {
  RenderParams params;
  params.scope_tip_W = Vec3f(0, 0, 0.1f);
  EXPECT_NEAR(MakeLaparoscope(params).light_power / 0.01f, 1, 1e-5f);
  params.scope_angle_deg = 0;
  EXPECT_NEAR(MakeLaparoscope(params).light_axis.dot(-Vec3f::UnitZ()), 1, 1e-6f);
  params.scope_angle_deg = 30;
  EXPECT_LT(MakeLaparoscope(params).light_axis.dot(-Vec3f::UnitZ()), 0.999f);
}

/// Six times the volume that the triangles enclose.
float SignedVolume(const Solid& solid) {
  float volume = 0;
  for (const Triangle& t : solid.triangles) {
    volume += solid.positions[t[0]].dot(solid.positions[t[1]].cross(solid.positions[t[2]]));
  }
  return volume;
}

TEST(SolidTest, FacesLookOutwardAndNormalsAgree) {
  const ToolShape shape{0.0025f, 0.33f, 0.0015f, 0.018f};
  for (const Solid& solid :
       {GrasperShaft(shape), GrasperJaw(shape), ScissorBlade(shape), Hook({0.0025f, 0.33f, 0.0006f, 0.005f})}) {
    EXPECT_GT(SignedVolume(solid), 0);
    for (const Triangle& t : solid.triangles) {
      const Vec3f area =
          (solid.positions[t[1]] - solid.positions[t[0]]).cross(solid.positions[t[2]] - solid.positions[t[0]]);
      const Vec3f normal = solid.normals[t[0]] + solid.normals[t[1]] + solid.normals[t[2]];
      EXPECT_GE(area.dot(normal), -1e-12f);
    }
  }
}

TEST(SolidTest, TipsAreWhereTheFrameSays) {
  const ToolShape shape{0.0025f, 0.33f, 0.0015f, 0.018f};
  float jaw_tip = 0;
  for (const Vec3f& p : GrasperJaw(shape).positions) {
    jaw_tip = std::max(jaw_tip, p.z());
  }
  EXPECT_NEAR(jaw_tip, shape.tip_length_m, 1e-5f);
  float foot = 0;
  for (const Vec3f& p : Hook({0.0025f, 0.33f, 0.0006f, 0.005f}).positions) {
    foot = std::max(foot, p.x());
  }
  EXPECT_NEAR(foot, 0.005f, 1e-5f);
}

TEST(TissuePatternTest, IsTheSameInEveryRunAndNotFlat) {
  const auto noise = MakeNoisePattern(64);
  EXPECT_EQ(noise, MakeNoisePattern(64));
  const auto vessels = MakeVesselPattern(128);
  EXPECT_EQ(vessels, MakeVesselPattern(128));
  const auto share = static_cast<double>(std::count_if(vessels.begin(), vessels.end(), [](auto v) { return v > 40; })) /
                     static_cast<double>(vessels.size());
  EXPECT_GT(share, 0.01);
  EXPECT_LT(share, 0.6);
}

TEST(TissuePatternTest, TheSlopeOfFatIsThatOfItsHeight) {
  constexpr int kSize = 128;
  const auto fat = MakeFatPattern(kSize);
  EXPECT_EQ(fat, MakeFatPattern(kSize));
  const auto at = [&](int x, int y, int channel) {
    const int texel = (y + kSize) % kSize * kSize + (x + kSize) % kSize;
    return static_cast<double>(fat[static_cast<std::size_t>(4 * texel + channel)]);
  };
  double along = 0, squared = 0, most = 0;  // Least squares: slope = share * difference of heights.
  int vessels = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      most = std::max(most, at(x, y, 2));
      vessels += at(x, y, 3) < 64 ? 1 : 0;
      for (const int channel : {0, 1}) {
        const double rise = at(x + 1 - channel, y + channel, 2) - at(x - 1 + channel, y - channel, 2);
        along += rise * (at(x, y, channel) - 128);
        squared += rise * rise;
      }
    }
  }
  constexpr double kHeight_m = 1.05e-3, kTwoTexels_m = 2.0 * static_cast<double>(kFatPeriod_m) / kSize;
  EXPECT_NEAR(along / squared, 64 * kHeight_m / 255 / kTwoTexels_m, 0.05 * along / squared);
  EXPECT_GT(most, 200);
  EXPECT_GT(vessels, 20);
  EXPECT_LT(vessels, kSize * kSize / 5);
}

TEST(LaparoscopeTest, ThePictureKeepsItsShapeInAnyWindow) {
  RenderParams params;
  params.width = 960;
  params.height = 540;
  EXPECT_EQ(FitPicture(params, 960, 540), (PixelBox{0, 0, 960, 540}));
  EXPECT_EQ(FitPicture(params, 1000, 1000), (PixelBox{0, 218, 1000, 563}));
  EXPECT_EQ(FitPicture(params, 2000, 540), (PixelBox{520, 0, 960, 540}));
  EXPECT_EQ(FitPicture(params, 20000, 20000).width, 7680) << "limited as a scene's";
  for (int width = 1; width < 2000; width += 37) {
    for (int height = 1; height < 2000; height += 41) {
      const PixelBox box = FitPicture(params, width, height);
      ASSERT_TRUE(box.x >= 0 && box.y >= 0 && box.width >= 1 && box.height >= 1);
      ASSERT_TRUE(box.x + box.width <= width && box.y + box.height <= height) << width << " x " << height;
      ASSERT_TRUE(box.width == width || box.height == height) << width << " x " << height;
      ASSERT_NEAR(9.0 * box.width, 16.0 * box.height, 8.0 + 1e-9) << "half a pixel of the width or of the height";
    }
  }
}

}  // namespace
}  // namespace fulcrum::render
