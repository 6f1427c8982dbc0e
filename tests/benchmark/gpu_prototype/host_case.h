// A substep of mode accurate in the middle of a pull, held at its linearisation: the parts of ImplicitSolver, open to
// another implementation of the linear solve.
#pragma once

#include <vector>

#include "physics_node/implicit/conjugate_gradients.h"
#include "physics_node/implicit/implicit_solver.h"

namespace fulcrum::physics {

/// Processor time of this process, all threads [us].
[[nodiscard]] double ProcessorUs();

class HostCase {
 public:
  /// Pulls a patch of 75 nodes in the middle of the sheet for `frames` steps of preset default, then predicts and
  /// linearises the next substep. Without tools and contacts; bodies beside the membrane and the organ sleep. Adds the
  /// processor time of the steps to `step_ms`.
  HostCase(const SceneView& scene, int frames, std::vector<double>* step_ms);
  HostCase(const HostCase&) = delete;
  HostCase& operator=(const HostCase&) = delete;

  [[nodiscard]] implicit::LinearSystem System() { return {context, inertia.inertia, &state, &scratch}; }
  /// Krylov q <- A p on the membrane, or on the organ, without bindings and hinges. Returns that part of p . A p, in
  /// the solver's order.
  double ApplySheet(const FloatArray& p);
  double ApplyOrgan(const FloatArray& p);
  /// The membrane's linearisation again, and its planes as DeviceSolve::ReadLinearisation has them.
  void LineariseSheet();
  [[nodiscard]] std::vector<float> Linearisation();
  /// The residual of the linearisation again: a solve changes it.
  void ResetResidual();
  /// The solver's own two iterations; Krylov d <- the correction.
  void Solve();
  /// On the host in either implementation: hats and coarse nodes from the residual and `scratch.row_sums`, and the
  /// organ's part of Krylov z; `sums` <- r . z of the organ by task.
  void SolveLevels(const implicit::LinearSystem& system, std::vector<double>* sums);

  const SceneView scene;
  const ElasticModel elastic;
  ParticleStore particles;
  TissueModel tissue;
  implicit::ImplicitModel model;
  implicit::Workers workers{1};
  implicit::SolverContext context;
  implicit::SolverState state;
  implicit::SolverScratch scratch;
  implicit::Inertia inertia;

 private:
  void Pull(int frames, std::vector<double>* step_ms);

  std::vector<implicit::HeldPlace> held_;
  FloatArray residual_;
};

}  // namespace fulcrum::physics
