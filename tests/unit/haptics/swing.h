// A tool that is swung about a trocar: wide, in both directions, in and out.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "haptics_node/device/recorded_motion.h"

namespace fulcrum::haptics::testing {

/// @param width_rad largest swing to each side.
/// @param noise_m play of the trocar: noise of the position, uniform on each axis.
inline std::vector<DevicePose> Swing(const Vec3d& p_DP, double width_rad, double noise_m, int count = 1000) {
  std::vector<DevicePose> poses;
  std::uint64_t state = 1;
  const auto noise = [&] {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return noise_m * (2.0 * static_cast<double>(state >> 11) / 9007199254740992.0 - 1.0);
  };
  for (int i = 0; i < count; ++i) {
    const double t = 0.01 * i;
    const double a = width_rad * std::sin(2.1 * t), b = width_rad * std::sin(2.9 * t + 0.4);
    DevicePose pose;
    pose.time_s = t;
    pose.d_D = Vec3d(std::tan(a), std::tan(b) - 1, -1).normalized();
    pose.p_D = p_DP - (0.14 + 0.03 * std::sin(1.3 * t)) * pose.d_D + Vec3d(noise(), noise(), noise());
    pose.buttons = 1;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace fulcrum::haptics::testing
