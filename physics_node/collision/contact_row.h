// A contact for a solver, independent of the bodies: a one-sided linear row over at most four particles,
//
//   g(x) = normal . (sum_k weight_k x_k) - offset >= 0,
//
// tissue against a tool (weights: barycentric coordinates; the offset contains the position of the tool's surface) or
// tissue against tissue (weights: 1 for a node, minus the barycentric coordinates of the triangle below it).
#pragma once

#include <array>
#include <cstdint>

#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics {

struct ContactRow {
  int count = 0;  ///< Particles in use, at most 4.
  std::array<ParticleRef, 4> at;
  std::array<float, 4> weight{0, 0, 0, 0};
  Vec3f normal = Vec3f::UnitZ();     ///< Unit; towards the permitted side.
  float offset = 0;                  ///< [m]
  float friction = 0;                ///< Coulomb coefficient.
  Vec3f drift = Vec3f::Zero();       ///< Movement of the other body's surface in this (sub)step; a body at rest: 0 [m].
  std::uint32_t source = 0;          ///< Index of the pair that made the row.
  float force_N = 0;                 ///< Out: normal force after the step.
  Vec3f friction_N = Vec3f::Zero();  ///< Out: friction force on the tissue.
  Vec3f unbalanced_N = Vec3f::Zero();  ///< Out: part of both that the tissue does not resist yet (mode accurate).

  /// sum_k weight_k x_k of a field in the layout of the particle pool.
  [[nodiscard]] Vec3f At(const float* field) const {
    Vec3f sum = Vec3f::Zero();
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      sum += weight[k] * FieldAt(field, at[k]);
    }
    return sum;
  }
};

}  // namespace fulcrum::physics
