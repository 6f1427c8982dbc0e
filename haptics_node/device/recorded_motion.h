// Poses of a hand over time, recorded with a device or written by hand. A simulated device plays them, and a trocar is
// calibrated from them.
//
//   time_s,x_mm,y_mm,z_mm,axis_x,axis_y,axis_z,buttons
//   0.000,0.0,12.5,-3.0,0.0,-0.7071,-0.7071,1
//
// All in the frame D of the device: the attach point, the unit vector along the tool towards its tip, a bit per button.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::haptics {

struct DevicePose {
  double time_s = 0;
  Vec3d p_D = Vec3d::Zero();    ///< Attach point [m].
  Vec3d d_D = -Vec3d::UnitZ();  ///< Unit vector along the tool, towards its tip.
  int buttons = 0;
};

class RecordedMotion {
 public:
  /// Throws InputError naming file, line, value and valid range: no such file, another header, a line without exactly
  /// eight finite numbers, time that does not increase, a place beyond 2 m, an axis whose length differs from 1 by more
  /// than 1 %, no poses or more than a million.
  static RecordedMotion Load(const std::filesystem::path& file);
  /// The same for text in memory; `name` replaces the file name in messages.
  static RecordedMotion Parse(const std::string& text, const std::string& name);

  /// Attach point at `time_s` [m], interpolated linearly between poses; constant before the first and after the last
  /// pose.
  [[nodiscard]] Vec3d PositionAt(double time_s) const noexcept;
  [[nodiscard]] const std::vector<DevicePose>& poses() const noexcept { return poses_; }

 private:
  std::vector<DevicePose> poses_;
};

/// Text of a file with these poses, in the format of Parse().
[[nodiscard]] std::string ToText(const std::vector<DevicePose>& poses);

}  // namespace fulcrum::haptics
