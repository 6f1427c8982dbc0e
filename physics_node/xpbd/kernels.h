// Projections of the XPBD solver as functions on plain arrays (tissue/batches.h): one source, three instruction sets,
// the same bits (simd/instruction_set.h).
//
//   dx_i = -w_i grad_i C  s C / (1 + s sum_j w_j |grad_j C|^2),   s = k h^2
//
// is one implicit step of length h of the energy k C^2 / 2, with lambda = 0 at the start of each substep (Macklin et
// al., Small Steps in Physics Simulation, 2019). Written with stiffnesses instead of compliances, a cut or degenerate
// element has s = 0 and needs no division by 0. The constraints C: kernels_impl.h.
#pragma once

#include "physics_node/simd/instruction_set.h"
#include "physics_node/tissue/batches.h"

namespace fulcrum::physics::xpbd {

/// Material of the tetrahedra in physics::TetBatch.
struct alignas(32) NeoHookeanBatch {
  float inverse_edges[9][kLanes];  ///< Row by row, of the matrix with columns X1 - X0, X2 - X0, X3 - X0 [1/m].
  float mu[kLanes];                ///< mu V [J].
  float lambda[kLanes];            ///< (lambda + mu) V [J].
};

/// Quadratic bending k/2 |sum_i c_i x_i - offset|^2 of the hinges in physics::BendingBatch.
struct alignas(32) HingeBatch {
  float c[4][kLanes];       ///< Dimensionless.
  float offset[3][kLanes];  ///< sum_i c_i x_i in the rest shape [m].
  float stiffness[kLanes];  ///< [N/m]
};

/// Fat of the bindings in physics::BindingBatch.
struct alignas(32) FatBatch {
  float stiffness[kLanes];  ///< [N/m]
};

struct Membrane {
  const float* stiffness[3];  ///< Planes like GridArrays::rest: tension per strain over length, A / L [N/m].
  /// By direction and axis: tension of an edge in the rest shape, directed from node to neighbour [N]. Null without
  /// prestrain.
  const float* rest_tension[3][3];
  float rest_scale;  ///< Length without tension over length in the rest shape: below 1 with prestrain.
  float stiffening;  ///< c of the tension A (e + c e^3).
};

struct Kernels {
  const char* name;
  void (*membrane)(const GridArrays& grid, const Membrane& membrane, float h_sq);
  void (*tets)(float* particles, const TetBatch* tets, const NeoHookeanBatch* material, std::size_t count, float h_sq);
  void (*hinges)(float* hinge_particles, const BendingBatch* hinges, const HingeBatch* material, std::size_t count,
                 float h_sq);
  void (*bindings)(float* pool, const BindingBatch* bindings, const FatBatch* material, std::size_t count, float h_sq);
};

/// Kernels of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::xpbd
