// The hot loops of the PBD solver as plain functions on plain arrays, compiled from one source for the baseline CPU,
// for AVX2 and for AVX-512. All give the same bits: every operation on a lane is an IEEE add, multiply, divide or
// square root, in one order. AVX-512 takes two batches of a colour at a time, which changes no lane.
//
// Nothing here includes a header with inline functions of its own: such a function, compiled for AVX2, could be the
// copy that the linker keeps for the whole program.
#pragma once

#include <cstddef>
#include <cstdint>

namespace fulcrum::physics {

/// Constraints of one batch; also the lanes of a membrane row.
inline constexpr int kLanes = 8;
/// Batches 2 i and 2 i + 1 are of one colour: each colour is filled up to a multiple of so many batches.
inline constexpr std::size_t kBatchesAtOnce = 2;

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

/// How a binding gives way, per iteration: drawn out, pressed in, and pressed in to less than `floor` of its height.
struct BindingStiffness {
  float tension;
  float compression;
  float floor;
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

struct IntegrateSettings {
  float keep;        ///< Part of the velocity that damping leaves in one step.
  float gravity[3];  ///< g * dt^2 [m].
  float limit;       ///< A coordinate that differs more from the previous one has been damaged from outside [m].
};

struct FinishResult {
  float max_step_sq;     ///< Largest squared movement of a free particle [m^2].
  std::uint32_t resets;  ///< Free particles put back or cut short.
};

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

struct Kernels {
  const char* name;

  /// One Gauss-Seidel sweep over the three edges of each node: even row pairs, then odd ones.
  void (*grid_stretch)(const GridArrays& grid, float k);
  /// `particles` xyzw.
  void (*springs)(float* particles, const SpringBatch* batches, std::size_t count, float k);
  void (*volumes)(float* particles, const TetBatch* batches, std::size_t count, float k);
  void (*bending)(float* hinge_particles, const BendingBatch* batches, std::size_t count, float k);
  void (*bindings)(float* pool, const BindingBatch* batches, std::size_t count, const BindingStiffness& stiffness);

  /// Verlet prediction of `count` entries (multiple of 8) of the planes: previous <- now, now <- now + velocity step.
  /// A damaged coordinate is taken from `previous`; returns how many.
  std::uint32_t (*integrate)(float* const now[3], float* const previous[3], const float* w, std::size_t count,
                             const IntegrateSettings& settings);
  /// Puts back what is not finite, and cuts short what has moved further than sqrt(limit_sq).
  FinishResult (*finish)(float* const now[3], const float* const previous[3], const float* w, std::size_t count,
                         float limit_sq);
  /// The same for xyzw particles; `count` floats, a multiple of 8.
  std::uint32_t (*integrate_xyzw)(float* now, float* previous, std::size_t count, const IntegrateSettings& settings);
  FinishResult (*finish_xyzw)(float* now, const float* previous, std::size_t count, float limit_sq);
  void (*block_bounds)(const GridArrays& grid, const BlockBounds& bounds);
  void (*first_touch)(const SegmentMotion& segment, const TouchSearch& search, const TriangleBatch& triangles,
                      TouchBatch* touch);
  /// `particles` xyzw.
  void (*feet)(const float* particles, const PointBatch& points, FootBatch* feet);
};

const Kernels& BaselineKernels();
const Kernels& Avx2Kernels();
const Kernels& Avx512Kernels();
/// The widest kernels of this CPU.
const Kernels& BestKernels();
/// False: the kernels of that name must not be called here.
bool HasAvx2();
bool HasAvx512();

}  // namespace fulcrum::physics
