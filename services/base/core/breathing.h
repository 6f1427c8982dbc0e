// Breathing motion of the surroundings of the tissue: one definition for collision and picture.
#pragma once

#include <cmath>
#include <numbers>

#include "services/base/core/scene_view.h"

namespace fulcrum {

/// Displacement of the breathing surroundings from their place in the scene at simulated time `time_s` [m]: amplitude
/// (1 - cos(2 pi t / period)) / 2 along the direction, so at rest at 0.
[[nodiscard]] inline Vec3f BreathingOffset(const Breathing& breathing, double time_s) {
  if (!(breathing.amplitude_m > 0.0f)) {
    return Vec3f::Zero();
  }
  const double phase = 2.0 * std::numbers::pi * time_s / static_cast<double>(breathing.period_s);
  return static_cast<float>(0.5 * static_cast<double>(breathing.amplitude_m) * (1.0 - std::cos(phase))) *
         breathing.direction;
}

/// Whether a surface breathes: the abdominal wall, the bladder and other free surroundings; not the pelvis, nor the
/// retroperitoneum, to which the membrane's rim is fixed.
[[nodiscard]] inline bool Breathes(SurfaceRole role) {
  return role != SurfaceRole::kPelvis && role != SurfaceRole::kRetroperitoneum;
}

}  // namespace fulcrum
