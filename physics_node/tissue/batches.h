// The tissue's constraints in the layout of the kernels: batches of eight of one colour, and the membrane as planes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "physics_node/simd/instruction_set.h"

namespace fulcrum::physics {

/// Eight springs of one colour. Vertices are offsets of xyzw particles in floats: 4 * index. A rest length of 0
/// disables the lane.
struct alignas(32) SpringBatch {
  std::uint32_t a[kLanes];
  std::uint32_t b[kLanes];
  float rest[kLanes];  ///< [m]
};

/// Eight tetrahedra of one colour. Vertices as in SpringBatch.
struct alignas(32) TetBatch {
  std::uint32_t v[4][kLanes];
  float rest_volume[kLanes];  ///< Six times the volume at rest [m^3].
  float floor[kLanes];        ///< Least divisor of sum w |6 gradient|^2, a small share of its rest value [m^4/kg].
};

/// Eight dihedral angles of one colour. Vertices are offsets, 4 * index, into the hinge particles: a copy in xyzw of
/// the few particles that hinges use. Gathered from the membrane's planes each particle would cost four cache lines per
/// hinge.
struct alignas(32) BendingBatch {
  std::uint32_t v[4][kLanes];
  float rest_angle[kLanes];  ///< [rad]
  float floor[kLanes];       ///< Least divisor of |normal|^2, a small share of its rest value [m^4].
  float active[kLanes];      ///< 1; 0 where the hinge is cut.
};

/// Eight bindings (eq. 9) of one colour: index 0 is the membrane's node, 1..3 the triangle of the organ's surface. A
/// particle's coordinates are pool[base + step * {0, 1, 2}], w at 3 * step; organ vertices have step 1.
struct alignas(32) BindingBatch {
  std::uint32_t base[4][kLanes];
  std::uint32_t step[4][kLanes];
  float barycentric[3][kLanes];
  float rest_length[kLanes];  ///< [m]
  float rest_height[kLanes];  ///< Of the node over the plane of the triangle [m].
  float active[kLanes];       ///< 1; 0 where the node is dead.
};

/// The membrane: coordinate planes of lane-blocked rows. Column c of row r lies in lane c / slots, slot c % slots, at
/// offset r * stride + slot * 8 + lane with stride = 8 * slots. The neighbour c + 1 is the next slot of the same lane
/// or the first slot of the next lane: no gather, one rotation per row.
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
