// Strokes of a hook over the sheet at constant speed.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "haptics_node/device/recorded_motion.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::benchmark {

using Vec2d = Eigen::Vector2d;

enum class Shape { kAlong, kAcross, k30deg, k45deg, kCircle, kSpiral, kEight, kZigzag, kStay };
[[nodiscard]] const char* NameOf(Shape shape);

/// Places about the shape's middle, s to x and t to y, no farther apart than a quarter of a millimetre [m].
/// @param longest_m lines and circles get no longer; the others have a size of their own.
[[nodiscard]] std::vector<Vec2d> CourseOf(Shape shape, double longest_m);

/// The sheet with its nodes at these places of frame W.
struct Sheet {
  const SceneView& scene;
  std::span<const Vec3f> nodes;  ///< [rows * cols]

  /// Above the place that has these material coordinates by `height_m`. Throws InputError beyond the sheet.
  [[nodiscard]] Vec3d Above(const Vec2d& material_m, double height_m) const;
  /// Material coordinates at fractions of the grid.
  [[nodiscard]] Vec2d MaterialAt(double s, double t) const;
};

struct StrokeTimes {
  double touch_s = 0;  ///< The hook is down.
  double begin_s = 0;  ///< It sets out.
  double end_s = 0;    ///< It has arrived.
  double over_s = 0;   ///< It has been lifted.
};

struct Stroke {
  std::vector<haptics::DevicePose> motion;  ///< Of the attach point, in a frame D at the trocar, parallel to W.
  StrokeTimes times;
};

/// The heel of tool 1 comes down at the first place, waits, goes along the course at `speed_m_s`, and is lifted.
/// @param heel_m its height above the sheet; negative: below.
[[nodiscard]] Stroke MakeStroke(const Sheet& sheet, const std::vector<Vec2d>& course_m, const Vec3d& trocar_W,
                                double speed_m_s, double heel_m, double touch_s, double stay_s);

}  // namespace fulcrum::benchmark
