// How free particles move in a step of position-based dynamics, in the paper's mode and in XPBD: prediction by Verlet's
// scheme, x* = x + (x - x_previous) keep + g dt^2, and a limit on what came of it.
#pragma once

#include "physics_node/simd/instruction_set.h"

namespace fulcrum::physics {

struct IntegrateSettings {
  float keep;        ///< Part of the velocity that damping leaves in one step.
  float gravity[3];  ///< g * dt^2 [m].
  float limit;       ///< A coordinate that differs more from the previous one has been damaged from outside [m].
};

struct FinishResult {
  float max_step_sq;     ///< Largest squared movement of a free particle [m^2].
  std::uint32_t resets;  ///< Free particles put back or cut short.
};

}  // namespace fulcrum::physics

namespace fulcrum::physics::tissue {

struct Kernels {
  const char* name;

  /// Verlet prediction of `count` entries (multiple of 8) of the planes: previous <- now, now <- now + velocity step.
  /// A damaged coordinate is taken from `previous`; returns how many.
  std::uint32_t (*integrate)(float* const now[3], float* const previous[3], const float* w, std::size_t count,
                             const IntegrateSettings& settings);
  /// Puts back what is not finite, and cuts short what has moved further than sqrt(limit_sq).
  FinishResult (*finish)(float* const now[3], const float* const previous[3], const float* w, std::size_t count,
                         float limit_sq);
  /// The same for xyzw particles; `count` floats, a multiple of 8.
  std::uint32_t (*integrate_xyzw)(float* now, float* previous, std::size_t count, const IntegrateSettings& settings);
  FinishResult (*finish_xyzw)(float* now, const float* previous, std::size_t count, float limit_sq);
};

/// Those of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::tissue
