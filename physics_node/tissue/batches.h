// The tissue's constraints as the kernels read them: batches of eight of one colour, and the membrane as planes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "physics_node/simd/instruction_set.h"

namespace fulcrum::physics {

/// Eight springs of one colour. Vertices are offsets of xyzw particles in floats: 4 * index. rest 0 switches a lane
/// off.
struct alignas(32) SpringBatch {
  std::uint32_t a[kLanes];
  std::uint32_t b[kLanes];
  float rest[kLanes];  ///< [m]
};

/// Eight tetrahedra of one colour. Vertices as in SpringBatch.
struct alignas(32) TetBatch {
  std::uint32_t v[4][kLanes];
  float rest_volume[kLanes];  ///< Six times it [m^3].
  float floor[kLanes];        ///< Least sum of w |6 gradient|^2 to divide by, a small part of its value at rest.
};

/// Eight dihedral angles of one colour. Vertices are offsets, 4 * index, into the hinge particles, a copy in xyzw of
/// the few particles that hinges use: gathered from the membrane's planes, each would cost four cache lines in each
/// hinge.
struct alignas(32) BendingBatch {
  std::uint32_t v[4][kLanes];
  float rest_angle[kLanes];  ///< [rad]
  float floor[kLanes];       ///< Least |normal|^2 to divide by, a small part of its value at rest [m^4].
  float active[kLanes];      ///< 1, or 0 where the hinge has been cut.
};

/// Eight bindings (eq. 9) of one colour: index 0 is the membrane's node, 1..3 the surface triangle. A particle's
/// coordinates are pool[base + step * {0, 1, 2}], w at 3 * step; the triangle's are the tube's, with step 1.
struct alignas(32) BindingBatch {
  std::uint32_t base[4][kLanes];
  std::uint32_t step[4][kLanes];
  float barycentric[3][kLanes];
  float rest_length[kLanes];  ///< [m]
  float rest_height[kLanes];  ///< Over the plane of the triangle [m].
  float active[kLanes];       ///< 1, or 0 where the node is dead.
};

/// The membrane: coordinate planes, lane-blocked rows. Column c of a row lies in lane c / slots, slot c % slots, at
/// offset row * stride + slot * 8 + lane with stride = 8 * slots. The neighbour c + 1 is the next slot of the same
/// lane, or the first slot of the next lane: no gather, one rotation per row.
struct GridArrays {
  float* x;
  float* y;
  float* z;
  const float* w;        ///< Inverse mass, 0 = fixed [1/kg].
  const float* rest[3];  ///< Rest length of the edges to (r, c+1), (r+1, c), (r+1, c+1); 0: no such edge [m].
  int rows;
  int slots;
};

}  // namespace fulcrum::physics
