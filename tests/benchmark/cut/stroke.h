// Strokes of a hook over the sheet at constant speed.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "haptics_node/device/recorded_motion.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::benchmark {

enum class Shape { kAlong, kAcross, k30deg, k45deg, kCircle, kSpiral, kEight, kZigzag, kStay };
[[nodiscard]] const char* NameOf(Shape shape);

/// Points relative to the middle of the shape, s to x and t to y, at most a quarter of a millimetre apart [m].
/// @param longest_m limit on the length of lines and circles; the other shapes have a fixed size.
[[nodiscard]] std::vector<Vec2d> CourseOf(Shape shape, double longest_m);

/// The sheet with its nodes at these positions in W.
struct Sheet {
  const SceneView& scene;
  std::span<const Vec3f> nodes;  ///< [rows * cols]

  /// Position `height_m` above the point with these material coordinates. Throws InputError beyond the sheet.
  [[nodiscard]] Vec3d Above(const Vec2d& material_m, double height_m) const;
  /// Material coordinates at fractions of the grid.
  [[nodiscard]] Vec2d MaterialAt(double s, double t) const;
};

struct StrokeTimes {
  double touch_s = 0;  ///< The hook is down.
  double begin_s = 0;  ///< The stroke begins.
  double end_s = 0;    ///< The stroke ends.
  double over_s = 0;   ///< The hook is lifted.
};

struct Stroke {
  std::vector<haptics::DevicePose> motion;  ///< Poses of the attach point, in a frame D at the trocar, parallel to W.
  StrokeTimes times;
};

/// The heel of tool 1 is lowered at the first point, waits, follows the course at `speed_m_s`, and is lifted.
/// @param heel_m height of the heel above the sheet; negative: below.
[[nodiscard]] Stroke MakeStroke(const Sheet& sheet, const std::vector<Vec2d>& course_m, const Vec3d& trocar_W,
                                double speed_m_s, double heel_m, double touch_s, double stay_s);

}  // namespace fulcrum::benchmark
