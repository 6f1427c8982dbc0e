// Projections of the constraints of mode paper as functions on plain arrays (tissue/batches.h):
//
//   dx_i = -k w_i grad_i C  C / sum_j w_j |grad_j C|^2        (Mueller et al., Position Based Dynamics, 2007)
//
// with the inverse masses w [1/kg] and a stiffness k in (0, 1] per iteration, one batch after the other (Gauss-Seidel).
// The constraints C(x) and their gradients: kernels_impl.h.
#pragma once

#include "physics_node/simd/instruction_set.h"
#include "physics_node/tissue/batches.h"

namespace fulcrum::physics::pbd {

/// Stiffness of bindings per iteration.
struct BindingStiffness {
  float tension;      ///< k of the length beyond its rest value.
  float compression;  ///< k of the height below its rest value.
  float floor;        ///< Share of the rest height below which the height is not allowed to fall.
};

struct Kernels {
  const char* name;

  /// One Gauss-Seidel sweep over the three edges of each node: even row pairs, then odd ones.
  void (*grid_stretch)(const GridArrays& grid, float k);
  /// `particles` xyzw.
  void (*springs)(float* particles, const SpringBatch* batches, std::size_t count, float k);
  void (*volumes)(float* particles, const TetBatch* batches, std::size_t count, float k);
  void (*bending)(float* hinge_particles, const BendingBatch* batches, std::size_t count, float k);
  void (*bindings)(float* pool, const BindingBatch* batches, std::size_t count, const BindingStiffness& stiffness);
};

/// Kernels of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::pbd
