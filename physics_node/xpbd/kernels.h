// The hot loops of the XPBD solver on the arrays of physics_node/pbd: one source, three instruction sets, the same bits
// (physics_node/pbd/kernels.h).
//
// Each projection solves one implicit step of its own energy with lambda starting from 0 in every substep (Macklin et
// al., Small Steps in Physics Simulation, 2019): with the stiffness s = k h^2 of C^2 k / 2,
//   dx_i = -w_i grad_i C  s C / (1 + s sum_j w_j |grad_j C|^2).
// Written with stiffnesses instead of compliances, an element that has been cut or is degenerate is just one with s =
// 0.
#pragma once

#include "physics_node/simd/instruction_set.h"
#include "physics_node/tissue/batches.h"

namespace fulcrum::physics::xpbd {

/// What a tetrahedron needs beside its vertices in physics::TetBatch.
struct alignas(32) NeoHookeanBatch {
  float inverse_edges[9][kLanes];  ///< Row by row, of the matrix with columns X1 - X0, X2 - X0, X3 - X0 [1/m].
  float mu[kLanes];                ///< mu V [J].
  float lambda[kLanes];            ///< (lambda + mu) V [J].
};

/// Quadratic bending k/2 |sum_i c_i x_i - offset|^2, beside physics::BendingBatch.
struct alignas(32) HingeBatch {
  float c[4][kLanes];
  float offset[3][kLanes];  ///< [m]
  float stiffness[kLanes];  ///< [N/m]
};

/// Beside physics::BindingBatch.
struct alignas(32) FatBatch {
  float stiffness[kLanes];  ///< [N/m]
};

struct Membrane {
  const float* stiffness[3];  ///< Planes like GridArrays::rest: tension per strain over length, A / L [N/m].
  /// By direction and axis: tension of an edge in the rest shape, along it from node to neighbour [N]. Null without
  /// prestrain.
  const float* rest_tension[3][3];
  float rest_scale;  ///< Unstrained length over rest length: below 1 where the membrane is prestrained.
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

/// Those of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::xpbd
