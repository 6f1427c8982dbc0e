// The linear solve of a substep: conjugate gradients on A d = r with the preconditioner of three levels, truncated
// after a few iterations (Hestenes and Stiefel 1952).
//
//   z_0 = M r_0,  p_0 = z_0                     M       preconditioner: blocks, hats, coarse nodes (coarse_space.h)
//   alpha_i = r_i . z_i / p_i . A p_i           A       K + inertia M at the linearisation point
//   d += alpha_i p_i,  r_i+1 = r_i - alpha_i A p_i
//   z_i+1 = M r_i+1,  beta_i = r_i+1 . z_i+1 / r_i . z_i,  p_i+1 = z_i+1 + beta_i p_i
//
// Of the last direction only the curvature is computed, and it is never stored. With n the last iteration, p_n and
// p_n-1 are conjugate, so
//
//   p_n . A p_n = z_n . A z_n - beta^2 p_n-1 . A p_n-1
//
// and the last two steps are made at once: d += (alpha_n-1 + alpha_n beta) p_n-1 + alpha_n z_n.
#pragma once

#include <span>

#include "physics_node/implicit/implicit_state.h"

namespace fulcrum::physics::implicit {

/// Made for a system and used up within a substep or a query; it allocates nothing.
class LinearSolver {
 public:
  /// All arguments must outlive this.
  LinearSolver(const SolverContext& context, const LinearSystem& system, SolverState* state, SolverScratch* scratch)
      : context_(context), system_(system), state_(*state), scratch_(*scratch) {}

  /// Selects the regions in which Solve leaves the residual: where it is a force, or where a descent continues from it.
  void SelectResidual(std::span<const std::uint8_t> regions);
  /// Krylov d <- the correction from 0, and the residual that of x* + d in the selected regions.
  void Solve(int iterations);
  /// One step of steepest descent with the diagonal blocks in the contact zone: with two iterations alone a pressed
  /// patch chatters. A third iteration everywhere would serve as well, at ten times the cost.
  void DescendInContactZone();

  /// Krylov q <- A p over all that is computed, without bindings and hinges (AddElements). Returns p . A p.
  double Apply(const FloatArray& p) { return Apply(p, state_.regions.computed(), state_.elements.computed()); }
  /// field += the last product of bindings and hinges at a task's particles.
  void AddElements(const Task& task, FloatArray* field) const;

 private:
  /// d <- before p + alpha (z + beta p), with p, z and q = A p of the last two iterations.
  struct LastStep {
    float alpha = 0, beta = 0, before = 0;
  };

  double Apply(const FloatArray& p, const RegionSet& regions, const Selection& selection);
  [[nodiscard]] double Curvature(const FloatArray& p);
  [[nodiscard]] double Precondition();
  void RestrictRows(const Task& task);
  void StartResidual();
  void Advance(const FloatArray& direction, float alpha, bool first, bool step_follows);
  void MakeLastStep(const LastStep& step, bool adds);

  const SolverContext& context_;
  const LinearSystem& system_;
  SolverState& state_;
  SolverScratch& scratch_;
};

/// A correction after its limits.
struct Correction {
  float largest_m = 0;  ///< Before the limits.
  bool line_searched = false;
  bool shortened = false;  ///< The residual is that of a longer one.
};
/// Limits the correction that a solve has left in Krylov d, and halves it while it raises the energy.
[[nodiscard]] Correction LimitCorrection(const SolverContext& context, const Inertia& inertia,
                                         std::span<const ContactRow> contacts, SolverState* state,
                                         SolverScratch* scratch);

}  // namespace fulcrum::physics::implicit
