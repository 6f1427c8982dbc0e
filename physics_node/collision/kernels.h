// Inner loops of collision detection as functions on plain arrays: bounds of blocks of the membrane, a moving segment
// against eight triangles, eight points against one triangle each. Distances are Euclidean [m]; closest points follow
// Ericson, Real-Time Collision Detection, 2005, chapter 5. Equations: kernels_impl.h, touch_impl.h.
#pragma once

#include "physics_node/simd/instruction_set.h"
#include "physics_node/tissue/batches.h"

namespace fulcrum::physics {

/// Rows of cells, and columns of a lane, in a block of the membrane with common bounds: a compromise between tight
/// bounds and few of them. Assumed.
inline constexpr std::uint32_t kBlockCells = 8;

/// Two segments whose angle has a squared sine below this are parallel within rounding.
inline constexpr float kParallelSinSq = 1e-6f;

/// Bounds of blocks of kBlockCells x kBlockCells cells [m]; index (row_block * slot_blocks + slot_block) * 8 + lane.
struct BlockBounds {
  float* lo[3];
  float* hi[3];
};

/// Eight triangles by corner and axis [m].
struct alignas(32) TriangleBatch {
  float corner[3][3][kLanes];
};

/// Linear motion of a segment: its ends at u in [0, 1] are from + u (to - from). By end and axis [m].
struct SegmentMotion {
  float from[2][3];
  float to[2][3];
};

/// Search for the first touch of a moving segment with triangles at rest.
struct TouchSearch {
  float u0, u1;  ///< Interval of the motion that is searched.
  float reach;   ///< Distance at which they touch [m].
  float travel;  ///< Path of the fastest point of the segment from u = 0 to 1 [m]. 0: only u1 is evaluated.
  float least;   ///< Least advance of u from one sample to the next.
  float range;   ///< Triangles further from the segment in the middle of the interval are skipped [m].
  float exact;   ///< Triangles further than this: only their centroid is evaluated, at u1 [m].
};

/// Closest points of the segment and the triangle in each lane, at the u of their first touch, or without touch at the
/// sample with the smallest distance.
struct alignas(32) TouchBatch {
  float u[kLanes];
  float distance_sq[kLanes];  ///< kLargestFinite where the triangle was skipped [m^2].
  float t[kLanes];            ///< Position along the segment, in [0, 1].
  float weight[3][kLanes];    ///< Barycentric, on the triangle.
  float crosses[kLanes];      ///< 1 where the segment passes through the triangle, else 0.
};

/// Eight points with one triangle of the organ each: offsets of its corners, 4 * index.
struct alignas(32) PointBatch {
  float point[3][kLanes];  ///< By axis [m].
  std::uint32_t corner[3][kLanes];
};

/// The point of each triangle closest to the point in its lane.
struct alignas(32) FootBatch {
  float weight[3][kLanes];    ///< Barycentric.
  float distance_sq[kLanes];  ///< [m^2]
  float side[kLanes];         ///< Sign: positive in front of the (counter-clockwise) triangle. Not a length.
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

/// Kernels of an instruction set that this CPU has.
const Kernels& KernelsFor(InstructionSet set = BestInstructionSet());

}  // namespace fulcrum::physics::collision
