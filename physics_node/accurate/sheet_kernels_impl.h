// Bodies of the membrane's kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set.
#pragma once

#include "physics_node/accurate/kernels.h"
#include "physics_node/pbd/lanes.h"

#define FULCRUM_INLINE_LAMBDA __attribute__((always_inline))

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using accurate::Inertia;
using accurate::Sheet;
using accurate::SheetLinearise;
using accurate::SheetMatrix;

inline std::size_t RowStart(const Sheet& sheet, int row) {
  return static_cast<std::size_t>(row) * 8 * static_cast<std::size_t>(sheet.slots);
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
  alignas(32) float f[8];
  v.Store(f);
  // Lanes in a fixed order, whatever the instruction set.
  return static_cast<double>(((f[0] + f[1]) + (f[2] + f[3])) + ((f[4] + f[5]) + (f[6] + f[7])));
}

/// The other end of the three edges of slot `s` in row `row`: the node to the right, below, below right. In the last
/// slot of a row the right neighbour is the first slot of the next lane.
struct Ends {
  V8 right, below, diagonal;
};
inline Ends LoadEnds(const Sheet& sheet, const float* const x[3], std::size_t at, int s, bool last_row) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots), first = at - 8 * static_cast<std::size_t>(s);
  const std::size_t below = last_row ? 0 : stride;  // The last row has no edge downwards: anything finite will do.
  const bool wraps = s + 1 == sheet.slots;
  Ends ends;
  ends.right = wraps ? DownV(LoadV(x, first)) : LoadV(x, at + 8);
  ends.below = LoadV(x, at + below);
  ends.diagonal = wraps ? DownV(LoadV(x, first + below)) : LoadV(x, at + below + 8);
  return ends;
}

inline void Clear(float* p, std::size_t count) {
  for (std::size_t i = 0; i < count; i += 8) {
    F8::All(0).Store(p + i);
  }
}

inline float LargestOf(F8 v) {
  alignas(32) float f[8];
  v.Store(f);
  float largest = 0;
  for (const float lane : f) {
    largest = lane > largest ? lane : largest;
  }
  return largest;
}

inline accurate::GuessCount SheetGuess(const Sheet& sheet, float h, const float* const start[3],
                                       const float* const velocity[3], float* const place[3], int row0, int row1) {
  F8 largest = F8::All(0);
  const F8 zero = F8::All(0), step = F8::All(h), sound = F8::All(1e30f);
  std::uint32_t resets = 0;
  for (std::size_t at = RowStart(sheet, row0), end = RowStart(sheet, row1); at < end; at += 8) {
    const F8 moves = F8::Load(sheet.w + at) > zero;
    V8 d = LoadV(velocity, at) * step;
    const F8 finite = Dot(d, d) < sound, keep = moves & finite;
    resets += static_cast<std::uint32_t>(__builtin_popcount(Bits(moves) & ~Bits(finite) & 0xffu));
    d = {d.x & keep, d.y & keep, d.z & keep};
    largest = Max(largest, Dot(d, d));
    StoreV(LoadV(start, at) + d, place, at);
  }
  return {LargestOf(largest), resets};
}

/// What an edge does to its first node: force, and the six entries xx yy zz xy xz yz of its stiffness.
struct Edge9 {
  F8 v[9];
};
inline Edge9 ZeroEdge() {
  Edge9 zero;
  for (F8& v : zero.v) {
    v = F8::All(0);
  }
  return zero;
}
FULCRUM_INLINE Edge9 UpEdge(const Edge9& edge) {
  Edge9 up;
  for (int c = 0; c < 9; ++c) {
    up.v[c] = RotateUp(edge.v[c]);
  }
  return up;
}
/// Forces act on the other end the other way, stiffness alike.
FULCRUM_INLINE F8 AddOther(F8 sum, F8 other, int c) { return c < 3 ? sum - other : sum + other; }

/// Linearises edges along `d`: stiffness kt I + along d d^T.
FULCRUM_INLINE Edge9 LineariseEdge(V8 d, F8 inverse_rest, F8 axial, F8 stiffening, F8* kt, F8* along) {
  const F8 zero = F8::All(0), one = F8::All(1.0f);
  const F8 length = Sqrt(Max(Dot(d, d), F8::All(1e-24f))), inverse = one / length;
  const F8 strain = length * inverse_rest - one, j = stiffening * (strain * strain);
  const F8 tension = axial * (strain * (one + j)) * inverse;
  const F8 tangent = axial * inverse_rest * (one + F8::All(3.0f) * j);
  *kt = Max(tension, zero);
  *along = Max(tangent - *kt, zero) * (inverse * inverse);
  const V8 f = d * tension, a = d * *along;
  return {{f.x, f.y, f.z, *kt + a.x * d.x, *kt + a.y * d.y, *kt + a.z * d.z, a.x * d.y, a.x * d.z, a.y * d.z}};
}

FULCRUM_INLINE void StoreInverseBlock(const F8 a[6], F8 moves, float* const block[6], std::size_t at) {
  const F8 xx = a[0], yy = a[1], zz = a[2], xy = a[3], xz = a[4], yz = a[5];
  const F8 c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
  const F8 c11 = xx * zz - xz * xz, c12 = xy * xz - xx * yz, c22 = xx * yy - xy * xy;
  const F8 scale = F8::All(1.0f) / (xx * c00 + xy * c01 + xz * c02);
  const F8 inverse[6] = {c00 * scale, c11 * scale, c22 * scale, c01 * scale, c02 * scale, c12 * scale};
  for (int i = 0; i < 6; ++i) {
    (inverse[i] & moves).Store(block[i] + at);
  }
}

/// One row: `above` is what the row above hands down, 9 planes of a row; what belongs to the next row goes to `below`.
/// With `only_below` nothing else is done.
template <bool only_below>
FULCRUM_INLINE void LineariseRow(const Sheet& sheet, const Inertia& inertia, const SheetLinearise& at,
                                 const SheetMatrix& matrix, const float* above, float* below, int row) {
  const std::size_t start = RowStart(sheet, row), stride = 8 * static_cast<std::size_t>(sheet.slots);
  const bool last_row = row + 1 == sheet.rows;
  const F8 stiffening = F8::All(sheet.stiffening), zero = F8::All(0);
  const F8 k = F8::All(inertia.inertia), inverse_h = F8::All(1.0f / inertia.h);
  const V8 gravity = {F8::All(inertia.gravity[0]), F8::All(inertia.gravity[1]), F8::All(inertia.gravity[2])};
  F8 kt, along;
  const auto edge = [&](int d, V8 vector, std::size_t node) FULCRUM_INLINE_LAMBDA {
    return LineariseEdge(vector, F8::Load(sheet.inverse_rest[d] + node), F8::Load(sheet.axial[d] + node), stiffening,
                         &kt, &along);
  };
  // What comes in from the slot before: into the first slot from the last, one lane on.
  const std::size_t last = start + stride - 8;
  const V8 x_last = LoadV(at.place, last);
  const Ends ends_last = LoadEnds(sheet, at.place, last, sheet.slots - 1, last_row);
  Edge9 left = only_below ? ZeroEdge() : UpEdge(edge(0, ends_last.right - x_last, last));
  Edge9 diagonal = UpEdge(edge(2, ends_last.diagonal - x_last, last));
  for (int s = 0; s < sheet.slots; ++s) {
    const std::size_t slot = 8 * static_cast<std::size_t>(s), node = start + slot;
    const V8 x = LoadV(at.place, node);
    const Ends ends = LoadEnds(sheet, at.place, node, s, last_row);
    const auto keep = [&](int d) FULCRUM_INLINE_LAMBDA {
      if (!only_below) {
        kt.Store(matrix.kt[d] + node);
        along.Store(matrix.along[d] + node);
      }
    };
    Edge9 sum;
    {
      const Edge9 down = edge(1, ends.below - x, node);
      keep(1);
      for (int c = 0; c < 9; ++c) {
        const auto plane = static_cast<std::size_t>(c) * stride + slot;
        if (!only_below) {
          sum.v[c] = AddOther(down.v[c], F8::Load(above + plane), c);
        }
        (down.v[c] + diagonal.v[c]).Store(below + plane);
      }
    }
    diagonal = edge(2, ends.diagonal - x, node);
    keep(2);
    if (only_below) {
      continue;
    }
    for (int c = 0; c < 9; ++c) {
      sum.v[c] = AddOther(sum.v[c] + diagonal.v[c], left.v[c], c);
    }
    left = edge(0, ends.right - x, node);
    keep(0);
    for (int c = 0; c < 9; ++c) {
      sum.v[c] = sum.v[c] + left.v[c];
    }
    const F8 moves = F8::Load(sheet.w + node) > zero, mass = F8::Load(sheet.mass + node) & moves;
    const V8 moved = x - LoadV(at.start, node);
    const V8 momentum = moved * k - LoadV(at.velocity, node) * inverse_h;
    const V8 elastic = {sum.v[0], sum.v[1], sum.v[2]};
    StoreV(elastic + LoadV(at.load, node) + (gravity - momentum) * mass, at.residual, node);
    const F8 own = F8::Load(at.extra + node) + mass * k;
    const F8 block[6] = {sum.v[3] + own, sum.v[4] + own, sum.v[5] + own, sum.v[6], sum.v[7], sum.v[8]};
    StoreInverseBlock(block, moves, matrix.block, node);
  }
}

inline void SheetLineariseRows(const Sheet& sheet, const Inertia& inertia, const SheetLinearise& at,
                               const SheetMatrix& matrix, float* memory, int row0, int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  float *above = memory, *below = memory + 9 * stride;
  if (row0 > 0) {
    LineariseRow<true>(sheet, inertia, at, matrix, nullptr, above, row0 - 1);
  } else {
    Clear(above, 9 * stride);
  }
  for (int row = row0; row < row1; ++row) {
    LineariseRow<false>(sheet, inertia, at, matrix, above, below, row);
    float* const used = above;
    above = below;
    below = used;
  }
}

/// (kt I + along d d^T) dp.
FULCRUM_INLINE V8 EdgeProduct(V8 d, V8 dp, F8 kt, F8 along) { return dp * kt + d * (along * Dot(d, dp)); }

/// K p of one row's edges and its inertia into `out`, what belongs to the next row into `below` [3]. Returns p . out.
template <bool only_below>
FULCRUM_INLINE F8 ApplyRow(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                           const float* above, float* below, float* const out[3], int row) {
  const std::size_t start = RowStart(sheet, row), stride = 8 * static_cast<std::size_t>(sheet.slots);
  const bool last_row = row + 1 == sheet.rows;
  const F8 zero = F8::All(0), k = F8::All(inertia);
  const auto edge = [&](int d, V8 vector, V8 dp, std::size_t node) FULCRUM_INLINE_LAMBDA {
    return EdgeProduct(vector, dp, F8::Load(matrix.kt[d] + node), F8::Load(matrix.along[d] + node));
  };
  F8 sum = zero;
  V8 left = ZeroV(), diagonal;
  {
    const std::size_t last = start + stride - 8;
    const V8 x = LoadV(matrix.place, last), here = LoadV(p, last);
    const Ends x_ends = LoadEnds(sheet, matrix.place, last, sheet.slots - 1, last_row);
    const Ends p_ends = LoadEnds(sheet, p, last, sheet.slots - 1, last_row);
    if (!only_below) {
      left = UpV(edge(0, x_ends.right - x, p_ends.right - here, last));
    }
    diagonal = UpV(edge(2, x_ends.diagonal - x, p_ends.diagonal - here, last));
  }
  const float* const from[3] = {above, above + stride, above + 2 * stride};
  float* const to[3] = {below, below + stride, below + 2 * stride};
  for (int s = 0; s < sheet.slots; ++s) {
    const std::size_t slot = 8 * static_cast<std::size_t>(s), node = start + slot;
    const V8 x = LoadV(matrix.place, node), here = LoadV(p, node);
    const Ends x_ends = LoadEnds(sheet, matrix.place, node, s, last_row);
    const Ends p_ends = LoadEnds(sheet, p, node, s, last_row);
    const V8 down = edge(1, x_ends.below - x, p_ends.below - here, node);
    const V8 came = diagonal;
    diagonal = edge(2, x_ends.diagonal - x, p_ends.diagonal - here, node);
    StoreV(down + came, to, slot);
    if (!only_below) {
      const V8 incoming = left + LoadV(from, slot);
      left = edge(0, x_ends.right - x, p_ends.right - here, node);
      const F8 mass = (F8::Load(sheet.mass + node) & (F8::Load(sheet.w + node) > zero)) * k;
      const V8 result = (incoming - ((left + down) + diagonal)) + here * mass;
      StoreV(result, out, node);
      sum = sum + Dot(here, result);
    }
  }
  return sum;
}

inline double SheetApply(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                         float* const out[3], float* memory, int row0, int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  float *above = memory, *below = memory + 3 * stride;
  if (row0 > 0) {
    (void)ApplyRow<true>(sheet, inertia, matrix, p, above, above, out, row0 - 1);
  } else {
    Clear(above, 3 * stride);
  }
  double sum = 0;
  for (int row = row0; row < row1; ++row) {
    sum += SumOf(ApplyRow<false>(sheet, inertia, matrix, p, above, below, out, row));
    float* const used = above;
    above = below;
    below = used;
  }
  return sum;
}

inline double SheetEnergy(const Sheet& sheet, const Inertia& inertia, const SheetLinearise& at, int row0, int row1) {
  const F8 half = F8::All(0.5f), quarter = F8::All(0.25f), zero = F8::All(0), c = F8::All(sheet.stiffening);
  const F8 k = F8::All(inertia.inertia), inverse_h = F8::All(1.0f / inertia.h);
  const V8 gravity = {F8::All(inertia.gravity[0]), F8::All(inertia.gravity[1]), F8::All(inertia.gravity[2])};
  double sum = 0;
  for (int row = row0; row < row1; ++row) {
    F8 energy = zero;
    for (int s = 0; s < sheet.slots; ++s) {
      const std::size_t node = RowStart(sheet, row) + 8 * static_cast<std::size_t>(s);
      const V8 x = LoadV(at.place, node);
      const Ends ends = LoadEnds(sheet, at.place, node, s, row + 1 == sheet.rows);
      const V8 other[3] = {ends.right, ends.below, ends.diagonal};
      for (int d = 0; d < 3; ++d) {
        const F8 inverse_rest = F8::Load(sheet.inverse_rest[d] + node), axial = F8::Load(sheet.axial[d] + node);
        const V8 edge = other[d] - x;
        const F8 strain = Sqrt(Max(Dot(edge, edge), F8::All(1e-24f))) * inverse_rest - F8::All(1.0f);
        const F8 e2 = strain * strain;
        // inverse_rest is that of an edge that exists wherever axial is not 0.
        energy = energy + (axial * (half * e2 + quarter * c * (e2 * e2))) / Max(inverse_rest, F8::All(1e-6f));
      }
      const F8 mass = F8::Load(sheet.mass + node) & (F8::Load(sheet.w + node) > zero);
      const V8 moved = x - LoadV(at.start, node);
      const V8 load = LoadV(at.load, node);
      energy = energy - Dot(moved, load);
      energy = energy + mass * (half * k * Dot(moved, moved) - inverse_h * Dot(moved, LoadV(at.velocity, node)) -
                                Dot(moved, gravity));
    }
    sum += SumOf(energy);
  }
  return sum;
}

inline void Combine(const float* z, float beta, float* p, std::size_t count) {
  const F8 b = F8::All(beta);
  for (std::size_t i = 0; i < count; i += 8) {
    (F8::Load(z + i) + F8::Load(p + i) * b).Store(p + i);
  }
}

inline void StartFields(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count) {
  const F8 a = F8::All(alpha);
  for (std::size_t i = 0; i < count; i += 8) {
    (F8::Load(p + i) * a).Store(d + i);
    (F8::Load(r + i) - F8::Load(q + i) * a).Store(r + i);
  }
}

inline void AdvanceFields(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count) {
  const F8 a = F8::All(alpha);
  for (std::size_t i = 0; i < count; i += 8) {
    (F8::Load(d + i) + F8::Load(p + i) * a).Store(d + i);
    (F8::Load(r + i) - F8::Load(q + i) * a).Store(r + i);
  }
}

inline bool Within(const float* p, float limit, std::size_t count, bool xyzw) {
  const F8 far = F8::All(limit);
  F8 inside = far > F8::All(0);
  for (std::size_t i = 0; i < count; i += 8) {
    inside = inside & (Abs(F8::Load(p + i)) < far);
  }
  return (Bits(inside) | (xyzw ? 0x88u : 0u)) == 0xffu;
}

inline float SheetLargest(const Sheet& sheet, const float* const d[3], int row0, int row1) {
  F8 largest = F8::All(0);
  for (std::size_t i = RowStart(sheet, row0), end = RowStart(sheet, row1); i < end; i += 8) {
    const V8 v = LoadV(d, i);
    largest = Max(Dot(v, v), largest);
  }
  return LargestOf(largest);
}

inline accurate::FinishCount SheetFinish(const Sheet& sheet, const float* const place[3], const float* const d[3],
                                         float h, float speed, float* const x[3], float* const velocity[3], int row0,
                                         int row1) {
  const F8 zero = F8::All(0), step = F8::All(h), inverse_h = F8::All(1.0f / h);
  const F8 limit = F8::All(speed), limit_sq = F8::All(speed * speed);
  F8 largest = zero;
  std::uint32_t resets = 0;
  for (std::size_t i = RowStart(sheet, row0), end = RowStart(sheet, row1); i < end; i += 8) {
    const V8 from = LoadV(x, i);
    V8 v = ((LoadV(place, i) + LoadV(d, i)) - from) * inverse_h;
    const F8 square = Dot(v, v), moves = F8::Load(sheet.w + i) > zero;
    const F8 finite = square<F8::All(1e30f), fast = square> limit_sq;
    resets += static_cast<std::uint32_t>(__builtin_popcount(Bits(moves) & ~Bits(finite) & 0xffu));
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
