// Motion of free particles in a step of position-based dynamics, in modes paper and xpbd: prediction by Verlet's
// scheme, x* = x + (x - x_previous) keep + g dt^2, and a limit on the movement after the projections. Equations:
// kernels_impl.h.
#pragma once

#include "physics_node/simd/instruction_set.h"

namespace fulcrum::physics {

struct IntegrateSettings {
  float keep;        ///< Share of the velocity that damping leaves in one step.
  float gravity[3];  ///< g * dt^2 [m].
  float limit;       ///< A coordinate that differs by this or more from the previous one is damaged [m].
};

struct FinishResult {
  float max_step_sq;     ///< Largest squared movement of the particles within the limit [m^2].
  std::uint32_t resets;  ///< Free particles that were restored or whose movement was limited.
};

}  // namespace fulcrum::physics

namespace fulcrum::physics::tissue {

struct Kernels {
  const char* name;

  /// Verlet prediction of `count` entries (a multiple of 8) of the planes: previous <- now, now <- now + velocity step.
  /// A damaged coordinate is first restored from `previous`; returns their number.
  std::uint32_t (*integrate)(float* const now[3], float* const previous[3], const float* w, std::size_t count,
                             const IntegrateSettings& settings);
  /// Restores particles that are not finite from `previous` and limits the movement of the others to sqrt(limit_sq).
  FinishResult (*finish)(float* const now[3], const float* const previous[3], const float* w, std::size_t count,
                         float limit_sq);
  /// The same for xyzw particles: `count` floats, a multiple of 8.
  std::uint32_t (*integrate_xyzw)(float* now, float* previous, std::size_t count, const IntegrateSettings& settings);
  FinishResult (*finish_xyzw)(float* now, const float* previous, std::size_t count, float limit_sq);
};

/// Kernels of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::tissue
