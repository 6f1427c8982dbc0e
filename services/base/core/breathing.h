// How what surrounds the tissue breathes: one motion for who collides with it and who draws it.
#pragma once

#include <cmath>
#include <numbers>

#include "services/base/core/scene_view.h"

namespace fulcrum {

/// Where the surroundings that breathe are at `time_s` of simulated time, against their place in the scene [m]:
/// amplitude (1 - cos(2 pi t / period)) / 2 along the direction, so at rest at 0.
[[nodiscard]] inline Vec3f BreathingOffset(const Breathing& breathing, double time_s) {
  if (!(breathing.amplitude_m > 0.0f)) {
    return Vec3f::Zero();
  }
  const double phase = 2.0 * std::numbers::pi * time_s / static_cast<double>(breathing.period_s);
  return static_cast<float>(0.5 * static_cast<double>(breathing.amplitude_m) * (1.0 - std::cos(phase))) *
         breathing.direction;
}

/// Wall, bladder and what else lies free; not the pelvis, nor the retroperitoneum, to which the membrane's rim is
/// fixed.
[[nodiscard]] inline bool Breathes(SurfaceRole role) {
  return role != SurfaceRole::kPelvis && role != SurfaceRole::kRetroperitoneum;
}

}  // namespace fulcrum
