#include "tests/benchmark/cut/stroke.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "haptics_node/kinematics/trocar.h"
#include "services/base/core/error.h"

namespace fulcrum::benchmark {
namespace {

constexpr double kStep_m = 0.25e-3;
/// Time between two poses of the motion [s].
constexpr double kPoseStep_s = 0.005;
constexpr double kHigh_m = 0.025, kReady_m = 0.008, kDown_s = 0.8, kLift_s = 0.5;

/// Points at equal steps of the parameter, thinned to at least kStep_m.
std::vector<Vec2d> Curve(const std::function<Vec2d(double)>& at) {
  constexpr int kFine = 4000;
  std::vector<Vec2d> course{at(0)};
  for (int i = 1; i <= kFine; ++i) {
    const Vec2d point = at(static_cast<double>(i) / kFine);
    if ((point - course.back()).norm() >= kStep_m || i == kFine) course.push_back(point);
  }
  return course;
}

std::vector<Vec2d> Line(const Vec2d& direction, double length) {
  return Curve([&](double u) { return Vec2d((u - 0.5) * length * direction.normalized()); });
}

std::vector<Vec2d> Zigzag() {
  // 2 mm from turn to turn, 5 mm to and fro.
  std::vector<Vec2d> corners;
  for (int i = 0; i <= 6; ++i) corners.emplace_back(i % 2 == 0 ? -2.5e-3 : 2.5e-3, 2e-3 * (i - 3));
  return Curve([&](double u) {
    const double at = u * static_cast<double>(corners.size() - 1);
    const auto i = std::min(static_cast<std::size_t>(at), corners.size() - 2);
    return Vec2d(corners[i] + (at - static_cast<double>(i)) * (corners[i + 1] - corners[i]));
  });
}

}  // namespace

const char* NameOf(Shape shape) {
  constexpr std::array kNames{"along", "across", "30deg", "45deg", "circle", "spiral", "eight", "zigzag", "stay"};
  return kNames[static_cast<std::size_t>(shape)];
}

std::vector<Vec2d> CourseOf(Shape shape, double longest_m) {
  constexpr double kTurn = 2 * std::numbers::pi;
  switch (shape) {
    case Shape::kAlong:
      return Line({0, 1}, longest_m);
    case Shape::kAcross:
      return Line({1, 0}, longest_m);
    case Shape::k30deg:
      return Line({0.5, std::sqrt(0.75)}, longest_m);
    case Shape::k45deg:
      return Line({1, 1}, longest_m);
    case Shape::kCircle:
      return Curve(
          [&](double u) { return Vec2d(longest_m / kTurn * Vec2d(std::cos(kTurn * u), std::sin(kTurn * u))); });
    case Shape::kSpiral:
      // 4 mm from turn to turn.
      return Curve([&](double u) {
        return Vec2d((1.5e-3 + 6e-3 * u) * Vec2d(std::cos(1.5 * kTurn * u), std::sin(1.5 * kTurn * u)));
      });
    case Shape::kEight:
      return Curve([&](double u) { return Vec2d(3e-3 * std::sin(2 * kTurn * u), 5.5e-3 * std::sin(kTurn * u)); });
    case Shape::kZigzag:
      return Zigzag();
    case Shape::kStay:
      return {Vec2d::Zero()};
  }
  return {};
}

Vec3d Sheet::Above(const Vec2d& material_m, double height_m) const {
  const MembraneGrid& grid = scene.membrane;
  for (std::size_t row = 0; row + 1 < grid.rows; ++row) {
    for (std::size_t col = 0; col + 1 < grid.cols; ++col) {
      const std::size_t n00 = row * grid.cols + col, n01 = n00 + 1, n10 = n00 + grid.cols, n11 = n10 + 1;
      for (const auto& t : {std::array{n00, n01, n11}, std::array{n00, n11, n10}}) {
        const auto place = [&](int i) {
          return scene.membrane_material[t[static_cast<std::size_t>(i)]].cast<double>();
        };
        const Vec2d a = place(0);
        Eigen::Matrix2d edges;
        edges << place(1) - a, place(2) - a;
        const Vec2d w = edges.inverse() * (material_m - a);
        constexpr double kRounding = 1e-6;
        if (w.minCoeff() < -kRounding || w.sum() > 1 + kRounding) continue;
        const Vec3d p0 = nodes[t[0]].cast<double>(), p1 = nodes[t[1]].cast<double>(), p2 = nodes[t[2]].cast<double>();
        const Vec3d normal = (p1 - p0).cross(p2 - p0).normalized();
        return p0 + w.x() * (p1 - p0) + w.y() * (p2 - p0) + height_m * normal;
      }
    }
  }
  throw InputError("a stroke leaves the sheet; shorten it or move it");
}

Vec2d Sheet::MaterialAt(double s, double t) const {
  const MembraneGrid& grid = scene.membrane;
  const auto col = static_cast<std::size_t>(std::lround(s * (grid.cols - 1)));
  const auto row = static_cast<std::size_t>(std::lround(t * (grid.rows - 1)));
  return scene.membrane_material[row * grid.cols + col].cast<double>();
}

Stroke MakeStroke(const Sheet& sheet, const std::vector<Vec2d>& course_m, const Vec3d& trocar_W, double speed_m_s,
                  double heel_m, double touch_s, double stay_s) {
  const haptics::Trocar trocar{trocar_W, static_cast<double>(sheet.scene.tools[1].shaft_length_m)};
  std::vector<Vec3d> path;
  std::vector<double> along{0};
  for (const Vec2d& place : course_m) path.push_back(sheet.Above(place, heel_m));
  for (std::size_t i = 1; i < path.size(); ++i) {
    along.push_back(along.back() + (course_m[i] - course_m[i - 1]).norm());
  }
  Stroke stroke;
  stroke.times.touch_s = touch_s;
  stroke.times.begin_s = touch_s + stay_s;
  stroke.times.end_s = stroke.times.begin_s + along.back() / speed_m_s;
  stroke.times.over_s = stroke.times.end_s + kLift_s;
  const Vec3d high = sheet.Above(course_m.front(), kHigh_m), ready = sheet.Above(course_m.front(), kReady_m);
  const Vec3d lifted = sheet.Above(course_m.back(), kHigh_m);
  const auto mix = [](const Vec3d& from, const Vec3d& to, double u) {
    u = std::clamp(u, 0.0, 1.0);
    return Vec3d(from + u * u * (3 - 2 * u) * (to - from));
  };
  const auto place_at = [&](double time_s) {
    const StrokeTimes& times = stroke.times;
    if (time_s < touch_s - kDown_s) return mix(high, ready, time_s / (touch_s - kDown_s));
    if (time_s < times.touch_s) return mix(ready, path.front(), 1 - (touch_s - time_s) / kDown_s);
    if (time_s > times.end_s) return mix(path.back(), lifted, (time_s - times.end_s) / kLift_s);
    const double gone = std::max(0.0, time_s - times.begin_s) * speed_m_s;
    const auto next = std::lower_bound(along.begin() + 1, along.end(), gone);
    if (next == along.end()) return path.back();
    const auto i = static_cast<std::size_t>(next - along.begin());
    return Vec3d(path[i - 1] + (gone - along[i - 1]) / (along[i] - along[i - 1]) * (path[i] - path[i - 1]));
  };
  for (double time_s = 0; time_s < stroke.times.over_s + kPoseStep_s; time_s += kPoseStep_s) {
    const Vec3d tip = place_at(time_s);
    haptics::DevicePose pose;
    pose.time_s = time_s;
    pose.p_D = haptics::AttachPointForTip(trocar, tip) - trocar.p_WP;
    pose.d_D = (tip - trocar.p_WP).normalized();
    stroke.motion.push_back(pose);
  }
  return stroke;
}

}  // namespace fulcrum::benchmark
