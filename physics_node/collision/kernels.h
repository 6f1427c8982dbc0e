// The hot loops of collision detection as plain functions on plain arrays: bounds of blocks of the membrane, a moving
// segment against eight triangles, eight points against one triangle each. Distances are Euclidean [m]; closest points
// follow Ericson, Real-Time Collision Detection, 2005, chapter 5.
#pragma once

#include "physics_node/simd/instruction_set.h"
#include "physics_node/tissue/batches.h"

namespace fulcrum::physics {

/// Bounds of blocks of 8 x 8 cells; array index (row_block * slot_blocks + slot_block) * 8 + lane.
struct BlockBounds {
  float* lo[3];
  float* hi[3];
};

/// Eight triangles, corner by corner and axis by axis [m].
struct alignas(32) TriangleBatch {
  float corner[3][3][kLanes];
};

/// A segment on its way: the ends at the part u are from + u (to - from). By end and axis [m].
struct SegmentMotion {
  float from[2][3];
  float to[2][3];
};

/// How a moving segment is held against triangles that stand still.
struct TouchSearch {
  float u0, u1;  ///< Part of the motion.
  float reach;   ///< They touch at this distance [m].
  float travel;  ///< How far any point of the segment goes from u = 0 to 1 [m]. 0: only u1 is looked at.
  float least;   ///< A look is at least this part further than the one before.
  float range;   ///< Triangles further from the segment in the middle of the motion are left alone [m].
  float exact;   ///< Of those beyond this only the middle is looked at, at u1 [m].
};

/// Closest points of the segment and the triangle in each lane, at the part `u` of the motion where they first touch,
/// else at the look where they were nearest.
struct alignas(32) TouchBatch {
  float u[kLanes];
  float distance_sq[kLanes];  ///< 3e38 where the triangle was left alone [m^2].
  float t[kLanes];            ///< Along the segment.
  float weight[3][kLanes];    ///< Barycentric, on the triangle.
  float crosses[kLanes];      ///< 1 where the segment passes through the triangle, else 0.
};

/// Eight points and a triangle of the organ for each: offsets of its corners, 4 * index.
struct alignas(32) PointBatch {
  float point[3][kLanes];  ///< By axis [m].
  std::uint32_t corner[3][kLanes];
};

/// The point of each triangle closest to the point in its lane.
struct alignas(32) FootBatch {
  float weight[3][kLanes];    ///< Barycentric.
  float distance_sq[kLanes];  ///< [m^2]
  float side[kLanes];         ///< Positive where the point is in front of the triangle, counter-clockwise; no length.
};

}  // namespace fulcrum::physics

namespace fulcrum::physics::collision {

struct Kernels {
  const char* name;

  void (*block_bounds)(const GridArrays& grid, const BlockBounds& bounds);
  void (*first_touch)(const SegmentMotion& segment, const TouchSearch& search, const TriangleBatch& triangles,
                      TouchBatch* touch);
  /// `particles` xyzw.
  void (*feet)(const float* particles, const PointBatch& points, FootBatch* feet);
};

/// Those of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::collision
