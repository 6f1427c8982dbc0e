// The stages of a substep around the linear solve: prediction, linearisation, update. Backward Euler, linearised once
// at the prediction x* (DESIGN.md, Mode accurate):
//
//   (K + s M) d = r(x*),    s = (1 + damping h) / h^2,    r = f(x*) + M (g - s (x* - x_n) + v_n / h)
//   x_n+1 = x* + d,         v_n+1 = (x_n+1 - x_n) / h
#pragma once

#include <cstdint>
#include <span>

#include "physics_node/implicit/implicit_state.h"

namespace fulcrum::physics::implicit {

/// A particle that a tool or a test holds; its inverse mass in the store is 0.
struct HeldPlace {
  ParticleRef at;
  Vec3f place = Vec3f::Zero();  ///< At the end of the substep [m].
};

/// What acts on the tissue in a substep.
struct BoundaryConditions {
  std::span<const HeldPlace> held;
  std::span<ContactRow> contacts;
};

/// Where the time of a substep went [ns].
struct SubstepTimes {
  std::int64_t prediction_ns = 0, linearisation_ns = 0, solve_ns = 0, update_ns = 0;
};

struct SubstepReport {
  float largest_correction_m = 0;  ///< Of the solve, to the prediction.
  float largest_speed_m_s = 0;
  std::uint32_t resets = 0;    ///< Particles put back because they were not finite.
  bool line_searched = false;  ///< The correction was compared in energy with the prediction.
  SubstepTimes times;
};

/// point <- the prediction x*. Returns how many velocities were not finite.
[[nodiscard]] std::uint32_t Predict(const SolverContext& context, const Inertia& inertia,
                                    const BoundaryConditions& boundary, SolverState* state, SolverScratch* scratch);
/// point <- the present positions.
void PredictAtRest(const SolverContext& context, SolverState* state, SolverScratch* scratch);
/// Residual, matrix and preconditioner at the prediction.
void Linearise(const SolverContext& context, const Inertia& inertia, std::span<const ContactRow> contacts,
               SolverState* state, SolverScratch* scratch);
/// Positions and velocities from x* + d. What is not finite stays where it was, at rest.
[[nodiscard]] SubstepReport Finish(const SolverContext& context, float h, SolverState* state, SolverScratch* scratch);

/// Elastic, inertial and contact energy at `point` of what is computed, for comparisons [J].
[[nodiscard]] double EnergyAt(const SolverContext& context, const FloatArray& point, const Inertia& inertia,
                              std::span<const ContactRow> contacts, SolverState* state, SolverScratch* scratch);

}  // namespace fulcrum::physics::implicit
