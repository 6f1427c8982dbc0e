// Kernels of the membrane that visit each node or edge once: prediction, energy, update; and the vector operations of
// conjugate gradients on fields. Compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set.
//
//   prediction  x* = x_n + min(1, limit / |h v_n|) h v_n
//   energy      E  = sum edges A L (e^2/2 + c e^4/4) + sum triangles
//                    + sum nodes m (s |u|^2/2 - u . v_n / h - u . g) - u . f
//   update      v_n+1 = min(1, speed / |v|) v,  v = (x* + d - x_n) / h;   x_n+1 = x_n + h v_n+1
//   inverse of a symmetric block: its cofactors over its determinant
//
//   x_n, v_n  position [m] and velocity [m/s] at the beginning of a substep of h [s]
//   x*, d     linearisation point and correction [m];  u = x - x_n
//   e = |x_j - x_i| / L - 1   strain of an edge of rest length L [m]; A tension per strain [N], c stiffening
//   m, f, g   mass [kg], dead load [N], gravity [m/s^2];  s = (1 + damping h) / h^2 [1/s^2]
//
// Stencil and layout. A node owns three edges: to the right, below and below right. Column c of a row stands in lane
// c / slots of slot c % slots, so eight nodes that are `slots` columns apart form one register, and their neighbours
// another:
//
//   slot    0     1    ...  slots - 1        right of slot s          : slot s + 1, same lanes
//   lane 0  c0    c1        c(slots - 1)     right of the last slot   : slot 0, one lane on (RotateDown)
//   lane 1  c(slots) ...                     below, below right       : the same `stride` = 8 slots floats further
#pragma once

#include "physics_node/implicit/kernels.h"
#include "physics_node/implicit/sheet_triangles_impl.h"
#include "physics_node/simd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using implicit::Inertia;
using implicit::kFiniteSquare;
using implicit::kLeastSquare_m2;
using implicit::Sheet;
using implicit::SheetFields;
using implicit::SheetMatrix;

/// Bits() of all eight lanes, and of those that hold w of two vertices xyzw.
constexpr unsigned kAllLanes = 0xffu, kWLanes = 0x88u;

inline std::size_t RowStart(const Sheet& sheet, int row) {
  return static_cast<std::size_t>(row) * kLanes * static_cast<std::size_t>(sheet.slots);
}
inline V8 LoadV(const float* const plane[3], std::size_t at) {
  return {F8::Load(plane[0] + at), F8::Load(plane[1] + at), F8::Load(plane[2] + at)};
}
inline void StoreV(V8 v, float* const plane[3], std::size_t at) {
  v.x.Store(plane[0] + at);
  v.y.Store(plane[1] + at);
  v.z.Store(plane[2] + at);
}
inline V8 DownV(V8 a) { return {RotateDown(a.x), RotateDown(a.y), RotateDown(a.z)}; }
inline V8 UpV(V8 a) { return {RotateUp(a.x), RotateUp(a.y), RotateUp(a.z)}; }
inline V8 ZeroV() { return {F8::All(0), F8::All(0), F8::All(0)}; }
inline double SumOf(F8 v) {
  alignas(32) float f[kLanes];
  v.Store(f);
  // Lanes in one order on every instruction set.
  return static_cast<double>(((f[0] + f[1]) + (f[2] + f[3])) + ((f[4] + f[5]) + (f[6] + f[7])));
}

/// The other end of the three edges of slot `s` in row `row`: the node to the right, below, below right. In the last
/// slot of a row the right neighbour is the first slot of the next lane.
struct Ends {
  V8 right, below, diagonal;
};
inline Ends LoadEnds(const Sheet& sheet, const float* const x[3], std::size_t at, int s, bool last_row) {
  const std::size_t stride = kLanes * static_cast<std::size_t>(sheet.slots),
                    first = at - kLanes * static_cast<std::size_t>(s);
  const std::size_t below = last_row ? 0 : stride;  // The last row has no edge downwards: any finite value serves.
  const bool wraps = s + 1 == sheet.slots;
  Ends ends;
  ends.right = wraps ? DownV(LoadV(x, first)) : LoadV(x, at + kLanes);
  ends.below = LoadV(x, at + below);
  ends.diagonal = wraps ? DownV(LoadV(x, first + below)) : LoadV(x, at + below + kLanes);
  return ends;
}

inline void Clear(float* p, std::size_t count) {
  for (std::size_t i = 0; i < count; i += kLanes) {
    F8::All(0).Store(p + i);
  }
}

inline float LargestOf(F8 v) {
  alignas(32) float f[kLanes];
  v.Store(f);
  float largest = 0;
  for (const float lane : f) {
    largest = lane > largest ? lane : largest;
  }
  return largest;
}

inline implicit::PredictionCount SheetPredict(const Sheet& sheet, float h, float limit, const float* const start[3],
                                              const float* const velocity[3], float* const point[3], int row0,
                                              int row1) {
  const F8 zero = F8::All(0), step = F8::All(h), one = F8::All(1.0f), most = F8::All(limit);
  const F8 finite_square = F8::All(kFiniteSquare);
  F8 largest = zero;
  std::uint32_t resets = 0;
  for (std::size_t at = RowStart(sheet, row0), end = RowStart(sheet, row1); at < end; at += kLanes) {
    const F8 moves = F8::Load(sheet.w + at) > zero;
    const V8 d = LoadV(velocity, at) * step;
    const F8 square = Dot(d, d), finite = square < finite_square, keep = moves & finite;
    resets += static_cast<std::uint32_t>(__builtin_popcount(Bits(moves) & ~Bits(finite) & kAllLanes));
    largest = Max(largest, square & keep);
    const F8 part = Min(one, most / Sqrt(Max(square, F8::All(kLeastSquare_m2))));
    const V8 shift = d * part;
    StoreV(LoadV(start, at) + V8{shift.x & keep, shift.y & keep, shift.z & keep}, point, at);
  }
  return {LargestOf(largest), resets};
}

/// Inverse of symmetric blocks xx yy zz xy xz yz, 0 where `moves` is not set.
template <class F, class Mask>
FULCRUM_INLINE void StoreInverseBlock(const F a[6], Mask moves, float* const block[6], std::size_t at) {
  const F xx = a[0], yy = a[1], zz = a[2], xy = a[3], xz = a[4], yz = a[5];
  const F c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
  const F c11 = xx * zz - xz * xz, c12 = xy * xz - xx * yz, c22 = xx * yy - xy * xy;
  const F scale = F::All(1.0f) / (xx * c00 + xy * c01 + xz * c02);
  const F inverse[6] = {c00 * scale, c11 * scale, c22 * scale, c01 * scale, c02 * scale, c12 * scale};
  for (int i = 0; i < 6; ++i) {
    (inverse[i] & moves).Store(block[i] + at);
  }
}

/// Least 1 / L that energies are divided by [1/m]: an edge of 1,000 km.
constexpr float kLeastInverseRest_per_m = 1e-6f;

inline double SheetEnergy(const Sheet& sheet, const Inertia& inertia, const SheetFields& fields, int row0, int row1) {
  const F8 half = F8::All(0.5f), quarter = F8::All(0.25f), zero = F8::All(0), c = F8::All(sheet.stiffening);
  const F8 k = F8::All(inertia.inertia), inverse_h = F8::All(1.0f / inertia.h);
  const V8 gravity = {F8::All(inertia.gravity[0]), F8::All(inertia.gravity[1]), F8::All(inertia.gravity[2])};
  double sum = 0;
  for (int row = row0; row < row1; ++row) {
    F8 energy = zero;
    for (int s = 0; s < sheet.slots; ++s) {
      const std::size_t node = RowStart(sheet, row) + kLanes * static_cast<std::size_t>(s);
      const V8 x = LoadV(fields.point, node);
      const Ends ends = LoadEnds(sheet, fields.point, node, s, row + 1 == sheet.rows);
      const V8 far_end[3] = {ends.right, ends.below, ends.diagonal};
      for (int d = 0; d < 3; ++d) {
        const F8 inverse_rest = F8::Load(sheet.inverse_rest[d] + node), axial = F8::Load(sheet.axial[d] + node);
        const V8 edge = far_end[d] - x;
        const F8 strain = Sqrt(Max(Dot(edge, edge), F8::All(kLeastSquare_m2))) * inverse_rest - F8::All(1.0f);
        const F8 e2 = strain * strain;
        // Where an edge exists, 1 / L is far above the bound; elsewhere axial is 0 and the quotient only finite.
        energy = energy +
                 (axial * (half * e2 + quarter * c * (e2 * e2))) / Max(inverse_rest, F8::All(kLeastInverseRest_per_m));
      }
      if (sheet.triangle[0] != nullptr) {
        const CellEdges<F8> cell = EdgesOfCell<F8>(ends.right - x, ends.below - x, ends.diagonal - x);
        energy =
            energy + (TriangleEnergy<F8>(sheet, 0, node, cell.of[0]) + TriangleEnergy<F8>(sheet, 1, node, cell.of[1]));
      }
      const F8 mass = F8::Load(sheet.mass + node) & (F8::Load(sheet.w + node) > zero);
      const V8 moved = x - LoadV(fields.start, node);
      const V8 load = LoadV(fields.load, node);
      energy = energy - Dot(moved, load);
      energy = energy + mass * (half * k * Dot(moved, moved) - inverse_h * Dot(moved, LoadV(fields.velocity, node)) -
                                Dot(moved, gravity));
    }
    sum += SumOf(energy);
  }
  return sum;
}

/// body(lanes, i) for `count` floats from any vertex on: eight at a time, then the rest one by one. `lanes` tells body
/// the type to load.
template <class Body>
FULCRUM_INLINE void ForFloats(std::size_t count, const Body& body) {
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    body(F8(), i);
  }
  for (; i < count; ++i) {
    body(0.0f, i);
  }
}
FULCRUM_INLINE F8 LoadAt(F8, const float* p) { return F8::LoadAny(p); }
FULCRUM_INLINE float LoadAt(float, const float* p) { return *p; }
FULCRUM_INLINE void StoreAt(F8 v, float* p) { v.StoreAny(p); }
FULCRUM_INLINE void StoreAt(float v, float* p) { *p = v; }
FULCRUM_INLINE F8 AllOf(F8, float s) { return F8::All(s); }
FULCRUM_INLINE float AllOf(float, float s) { return s; }

inline void Combine(const float* z, float beta, float* p, std::size_t count) {
  ForFloats(count,
            [=](auto l, std::size_t i) { StoreAt(LoadAt(l, z + i) + LoadAt(l, p + i) * AllOf(l, beta), p + i); });
}

inline void StartFields(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count) {
  ForFloats(count, [=](auto l, std::size_t i) {
    StoreAt(LoadAt(l, p + i) * AllOf(l, alpha), d + i);
    StoreAt(LoadAt(l, r + i) - LoadAt(l, q + i) * AllOf(l, alpha), r + i);
  });
}

inline void AdvanceFields(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count) {
  ForFloats(count, [=](auto l, std::size_t i) {
    StoreAt(LoadAt(l, d + i) + LoadAt(l, p + i) * AllOf(l, alpha), d + i);
    StoreAt(LoadAt(l, r + i) - LoadAt(l, q + i) * AllOf(l, alpha), r + i);
  });
}

inline void AddFields(float alpha, const float* p, float* d, std::size_t count) {
  ForFloats(count,
            [=](auto l, std::size_t i) { StoreAt(LoadAt(l, d + i) + LoadAt(l, p + i) * AllOf(l, alpha), d + i); });
}

inline bool Within(const float* p, float limit, std::size_t count, bool xyzw) {
  const F8 bound = F8::All(limit);
  F8 inside = bound > F8::All(0);
  for (std::size_t i = 0; i < count; i += kLanes) {
    inside = inside & (Abs(F8::Load(p + i)) < bound);
  }
  return (Bits(inside) | (xyzw ? kWLanes : 0u)) == kAllLanes;
}

inline float SheetStep(const Sheet& sheet, float a, const float* const p[3], float b, const float* const z[3],
                       bool adds, float* const d[3], int row0, int row1) {
  const F8 of_p = F8::All(a), of_z = F8::All(b);
  F8 largest = F8::All(0);
  for (std::size_t i = RowStart(sheet, row0), end = RowStart(sheet, row1); i < end; i += kLanes) {
    V8 v = LoadV(p, i) * of_p + LoadV(z, i) * of_z;
    if (adds) {
      v = LoadV(d, i) + v;
    }
    StoreV(v, d, i);
    largest = Max(Dot(v, v), largest);
  }
  return LargestOf(largest);
}

inline float SheetLargest(const Sheet& sheet, const float* const d[3], int row0, int row1) {
  F8 largest = F8::All(0);
  for (std::size_t i = RowStart(sheet, row0), end = RowStart(sheet, row1); i < end; i += kLanes) {
    const V8 v = LoadV(d, i);
    largest = Max(Dot(v, v), largest);
  }
  return LargestOf(largest);
}

inline implicit::FinishCount SheetFinish(const Sheet& sheet, const float* const point[3], const float* const d[3],
                                         float h, float speed, float* const x[3], float* const velocity[3], int row0,
                                         int row1) {
  const F8 zero = F8::All(0), step = F8::All(h), inverse_h = F8::All(1.0f / h);
  const F8 limit = F8::All(speed), limit_sq = F8::All(speed * speed);
  F8 largest = zero;
  std::uint32_t resets = 0;
  for (std::size_t i = RowStart(sheet, row0), end = RowStart(sheet, row1); i < end; i += kLanes) {
    const V8 from = LoadV(x, i);
    V8 v = ((LoadV(point, i) + LoadV(d, i)) - from) * inverse_h;
    const F8 square = Dot(v, v), moves = F8::Load(sheet.w + i) > zero;
    const F8 finite = square<F8::All(kFiniteSquare), fast = square> limit_sq;
    resets += static_cast<std::uint32_t>(__builtin_popcount(Bits(moves) & ~Bits(finite) & kAllLanes));
    v = {v.x & finite, v.y & finite, v.z & finite};
    if (Bits(fast & finite) != 0) {
      const F8 part = Select(fast & finite, limit / Sqrt(square), F8::All(1.0f));
      v = v * part;
    }
    largest = Max(Min(square & finite, limit_sq) & moves, largest);
    StoreV(v, velocity, i);
    StoreV(from + v * step, x, i);
  }
  return {LargestOf(largest), resets};
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
