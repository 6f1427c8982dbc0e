// Bodies of the membrane's kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set.
#pragma once

#include "physics_node/accurate/kernels.h"
#include "physics_node/pbd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using accurate::Inertia;
using accurate::kCarry;
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

struct Spring8 {
  F8 length, strain, tension;
  V8 direction;
};
inline Spring8 Stretch(V8 d, F8 inverse_rest, F8 axial, F8 stiffening) {
  Spring8 s;
  const F8 length_sq = Max(Dot(d, d), F8::All(1e-24f));
  s.length = Sqrt(length_sq);
  s.direction = d * (F8::All(1.0f) / s.length);
  s.strain = s.length * inverse_rest - F8::All(1.0f);
  s.tension = axial * (s.strain * (F8::All(1.0f) + stiffening * (s.strain * s.strain)));
  return s;
}

/// Rows of partial sums: `now` of the row being finished, `next` of the one below; N floats per node.
template <int N>
struct Carry {
  float* now;
  float* next;
  std::size_t stride;
  Carry(float* memory, std::size_t row_stride) : now(memory), next(memory + N * row_stride), stride(row_stride) {
    Clear(now);
    Clear(next);
  }
  void Clear(float* row) const {
    for (std::size_t i = 0; i < N * stride; i += 8) {
      F8::All(0).Store(row + i);
    }
  }
  void Advance() {
    float* done = now;
    now = next;
    next = done;
    Clear(next);
  }
  static void Add(float* row, std::size_t row_stride, int component, std::size_t at, F8 v) {
    float* p = row + static_cast<std::size_t>(component) * row_stride + at;
    (F8::Load(p) + v).Store(p);
  }
  void AddNow(int c, std::size_t at, F8 v) const { Add(now, stride, c, at, v); }
  void AddNext(int c, std::size_t at, F8 v) const { Add(next, stride, c, at, v); }
  void AddNowV(std::size_t at, V8 v) const {
    AddNow(0, at, v.x);
    AddNow(1, at, v.y);
    AddNow(2, at, v.z);
  }
  void AddNextV(std::size_t at, V8 v) const {
    AddNext(0, at, v.x);
    AddNext(1, at, v.y);
    AddNext(2, at, v.z);
  }
  [[nodiscard]] F8 Now(int c, std::size_t at) const {
    return F8::Load(now + static_cast<std::size_t>(c) * stride + at);
  }
};

inline float SheetGuess(const Sheet& sheet, float h, const float* const start[3], const float* const velocity[3],
                        float* const place[3], int row0, int row1) {
  F8 largest = F8::All(0);
  const F8 zero = F8::All(0), step = F8::All(h);
  for (std::size_t at = RowStart(sheet, row0), end = RowStart(sheet, row1); at < end; at += 8) {
    const F8 moves = F8::Load(sheet.w + at) > zero;
    V8 d = LoadV(velocity, at) * step;
    d = {d.x & moves, d.y & moves, d.z & moves};
    largest = Max(largest, Dot(d, d));
    StoreV(LoadV(start, at) + d, place, at);
  }
  alignas(32) float f[8];
  largest.Store(f);
  float result = 0;
  for (const float v : f) {
    result = v > result ? v : result;
  }
  return result;
}

/// Stiffness of an edge: transverse part kt >= 0 and m m^T along it.
struct Stiffness8 {
  F8 kt;
  V8 m;
};
inline Stiffness8 EdgeStiffness(const Spring8& s, F8 inverse_rest, F8 axial, F8 stiffening) {
  const F8 zero = F8::All(0);
  const F8 along = axial * inverse_rest * (F8::All(1.0f) + F8::All(3.0f) * (stiffening * (s.strain * s.strain)));
  const F8 kt = Max(s.tension / s.length, zero);
  return {kt, s.direction * Sqrt(Max(along - kt, zero))};
}
inline void AddBlock(const Carry<9>& carry, bool next, std::size_t at, const Stiffness8& k) {
  const F8 block[6] = {k.kt + k.m.x * k.m.x, k.kt + k.m.y * k.m.y, k.kt + k.m.z * k.m.z,
                       k.m.x * k.m.y,        k.m.x * k.m.z,        k.m.y * k.m.z};
  for (int i = 0; i < 6; ++i) {
    if (next) {
      carry.AddNext(3 + i, at, block[i]);
    } else {
      carry.AddNow(3 + i, at, block[i]);
    }
  }
}
inline Stiffness8 UpK(const Stiffness8& k) { return {RotateUp(k.kt), UpV(k.m)}; }

/// Edges of one row: forces and blocks into the carry, and (unless `only_below`) the edge's stiffness into the matrix.
inline void LineariseRow(const Sheet& sheet, const SheetLinearise& at, const SheetMatrix& matrix, const Carry<9>& carry,
                         int row, bool only_below) {
  const std::size_t start = RowStart(sheet, row);
  const F8 stiffening = F8::All(sheet.stiffening);
  for (int s = 0; s < sheet.slots; ++s) {
    const std::size_t slot = 8 * static_cast<std::size_t>(s), node = start + slot;
    const bool wraps = s + 1 == sheet.slots;
    const V8 x = LoadV(at.place, node);
    const Ends ends = LoadEnds(sheet, at.place, node, s, row + 1 == sheet.rows);
    const V8 other[3] = {ends.right, ends.below, ends.diagonal};
    for (int d = only_below ? 1 : 0; d < 3; ++d) {
      const F8 inverse_rest = F8::Load(sheet.inverse_rest[d] + node), axial = F8::Load(sheet.axial[d] + node);
      const Spring8 spring = Stretch(other[d] - x, inverse_rest, axial, stiffening);
      const Stiffness8 k = EdgeStiffness(spring, inverse_rest, axial, stiffening);
      const V8 force = spring.direction * spring.tension;
      if (!only_below) {
        StoreV(k.m, matrix.m[d], node);
        k.kt.Store(matrix.kt[d] + node);
        carry.AddNowV(slot, force);
        AddBlock(carry, false, slot, k);
      }
      const V8 back = ZeroV() - force;
      const bool turn = wraps && d != 1;
      const std::size_t to = d == 1 ? slot : (wraps ? 0 : slot + 8);
      const V8 f = turn ? UpV(back) : back;
      const Stiffness8 kt = turn ? UpK(k) : k;
      if (d == 0) {
        carry.AddNowV(to, f);
      } else {
        carry.AddNextV(to, f);
      }
      AddBlock(carry, d != 0, to, kt);
    }
  }
}

inline void StoreInverse(const F8 a[6], F8 moves, const SheetMatrix& matrix, std::size_t at) {
  const F8 xx = a[0], yy = a[1], zz = a[2], xy = a[3], xz = a[4], yz = a[5];
  const F8 c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
  const F8 c11 = xx * zz - xz * xz, c12 = xy * xz - xx * yz, c22 = xx * yy - xy * xy;
  const F8 scale = (F8::All(1.0f) / (xx * c00 + xy * c01 + xz * c02)) & moves;
  const F8 inverse[6] = {c00 * scale, c11 * scale, c22 * scale, c01 * scale, c02 * scale, c12 * scale};
  for (int i = 0; i < 6; ++i) {
    (inverse[i] & moves).Store(matrix.block[i] + at);
  }
}

inline void SheetLineariseRows(const Sheet& sheet, const Inertia& inertia, const SheetLinearise& at,
                               const SheetMatrix& matrix, float* memory, int row0, int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  Carry<9> carry(memory, stride);
  if (row0 > 0) {
    LineariseRow(sheet, at, matrix, carry, row0 - 1, true);
    carry.Advance();
  }
  const F8 zero = F8::All(0), k = F8::All(inertia.inertia), inverse_h = F8::All(1.0f / inertia.h);
  const V8 gravity = {F8::All(inertia.gravity[0]), F8::All(inertia.gravity[1]), F8::All(inertia.gravity[2])};
  for (int row = row0; row < row1; ++row) {
    LineariseRow(sheet, at, matrix, carry, row, false);
    const std::size_t start = RowStart(sheet, row);
    for (std::size_t slot = 0; slot < stride; slot += 8) {
      const std::size_t node = start + slot;
      const F8 moves = F8::Load(sheet.w + node) > zero, mass = F8::Load(sheet.mass + node) & moves;
      const V8 moved = LoadV(at.place, node) - LoadV(at.start, node);
      const V8 momentum = moved * k - LoadV(at.velocity, node) * inverse_h;
      const V8 elastic = {carry.Now(0, slot), carry.Now(1, slot), carry.Now(2, slot)};
      StoreV(elastic + (gravity - momentum) * mass, at.residual, node);
      const F8 own = F8::Load(at.extra + node) + mass * k;
      const F8 block[6] = {carry.Now(3, slot) + own, carry.Now(4, slot) + own, carry.Now(5, slot) + own,
                           carry.Now(6, slot),       carry.Now(7, slot),       carry.Now(8, slot)};
      StoreInverse(block, moves, matrix, node);
    }
    carry.Advance();
  }
}

/// K p of one row's edges into the carry; returns the sum of p^T K p over the edges that the row owns.
inline F8 ApplyRow(const Sheet& sheet, const SheetMatrix& matrix, const float* const p[3], const Carry<3>& carry,
                   int row, bool only_below) {
  const std::size_t start = RowStart(sheet, row);
  F8 sum = F8::All(0);
  for (int s = 0; s < sheet.slots; ++s) {
    const std::size_t slot = 8 * static_cast<std::size_t>(s), node = start + slot;
    const bool wraps = s + 1 == sheet.slots;
    const V8 here = LoadV(p, node);
    const Ends ends = LoadEnds(sheet, p, node, s, row + 1 == sheet.rows);
    const V8 other[3] = {ends.right, ends.below, ends.diagonal};
    V8 own = ZeroV();
    for (int d = only_below ? 1 : 0; d < 3; ++d) {
      const V8 m = LoadV(matrix.m[d], node), dp = other[d] - here;
      const V8 force = dp * F8::Load(matrix.kt[d] + node) + m * Dot(m, dp);
      sum = sum + Dot(dp, force);
      own = own - force;
      const V8 f = wraps && d != 1 ? UpV(force) : force;
      const std::size_t to = d == 1 ? slot : (wraps ? 0 : slot + 8);
      if (d == 0) {
        carry.AddNowV(to, f);
      } else {
        carry.AddNextV(to, f);
      }
    }
    if (!only_below) {
      carry.AddNowV(slot, own);
    }
  }
  return sum;
}

inline double SheetApply(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                         float* const out[3], float* memory, int row0, int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  Carry<3> carry(memory, stride);
  if (row0 > 0) {
    (void)ApplyRow(sheet, matrix, p, carry, row0 - 1, true);
    carry.Advance();
  }
  double sum = 0;
  const F8 k = F8::All(inertia), zero = F8::All(0);
  for (int row = row0; row < row1; ++row) {
    F8 dot = ApplyRow(sheet, matrix, p, carry, row, false);
    const std::size_t start = RowStart(sheet, row);
    for (std::size_t slot = 0; slot < stride; slot += 8) {
      const std::size_t node = start + slot;
      const F8 mass = (F8::Load(sheet.mass + node) & (F8::Load(sheet.w + node) > zero)) * k;
      const V8 here = LoadV(p, node), inertial = here * mass;
      dot = dot + Dot(here, inertial);
      StoreV(V8{carry.Now(0, slot), carry.Now(1, slot), carry.Now(2, slot)} + inertial, out, node);
    }
    sum += SumOf(dot);
    carry.Advance();
  }
  return sum;
}

inline double SheetEnergy(const Sheet& sheet, const Inertia& inertia, const SheetLinearise& at, int row0, int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
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
      energy = energy + mass * (half * k * Dot(moved, moved) - inverse_h * Dot(moved, LoadV(at.velocity, node)) -
                                Dot(moved, gravity));
    }
    sum += SumOf(energy);
  }
  (void)stride;
  return sum;
}

inline double SheetPrecondition(const Sheet& sheet, const SheetMatrix& matrix, const float* const r[3],
                                const float* coarse, const float* weights, int columns, float* const z[3], int row0,
                                int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  const F8 zero = F8::All(0);
  double sum = 0;
  for (int row = row0; row < row1; ++row) {
    const float* value = coarse + static_cast<std::size_t>(3 * columns) * static_cast<std::size_t>(row);
    F8 dot = zero;
    for (std::size_t slot = 0; slot < stride; slot += 8) {
      const std::size_t node = RowStart(sheet, row) + slot;
      V8 far = ZeroV();
      for (int c = 0; c < columns; ++c) {
        const F8 weight = F8::Load(weights + static_cast<std::size_t>(c) * stride + slot);
        far = far + V8{F8::All(value[3 * c]), F8::All(value[3 * c + 1]), F8::All(value[3 * c + 2])} * weight;
      }
      const F8 moves = F8::Load(sheet.w + node) > zero;
      const V8 b = LoadV(r, node);
      const F8 xx = F8::Load(matrix.block[0] + node), yy = F8::Load(matrix.block[1] + node),
               zz = F8::Load(matrix.block[2] + node), xy = F8::Load(matrix.block[3] + node),
               xz = F8::Load(matrix.block[4] + node), yz = F8::Load(matrix.block[5] + node);
      const V8 near = {xx * b.x + xy * b.y + xz * b.z, xy * b.x + yy * b.y + yz * b.z, xz * b.x + yz * b.y + zz * b.z};
      const V8 result = {near.x + (far.x & moves), near.y + (far.y & moves), near.z + (far.z & moves)};
      StoreV(result, z, node);
      dot = dot + Dot(b, result);
    }
    sum += SumOf(dot);
  }
  return sum;
}

inline void SheetRestrict(const Sheet& sheet, const float* const r[3], const float* weights, int columns, float* sums,
                          int row0, int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  const F8 zero = F8::All(0);
  for (int row = row0; row < row1; ++row) {
    float* out = sums + static_cast<std::size_t>(3 * columns) * static_cast<std::size_t>(row);
    for (int c = 0; c < columns; ++c) {
      V8 total = ZeroV();
      for (std::size_t slot = 0; slot < stride; slot += 8) {
        const std::size_t node = RowStart(sheet, row) + slot;
        const F8 weight =
            F8::Load(weights + static_cast<std::size_t>(c) * stride + slot) & (F8::Load(sheet.w + node) > zero);
        total = total + LoadV(r, node) * weight;
      }
      out[3 * c] = static_cast<float>(SumOf(total.x));
      out[3 * c + 1] = static_cast<float>(SumOf(total.y));
      out[3 * c + 2] = static_cast<float>(SumOf(total.z));
    }
  }
}

inline void Combine(const float* z, float beta, float* p, std::size_t count) {
  const F8 b = F8::All(beta);
  for (std::size_t i = 0; i < count; i += 8) {
    (F8::Load(z + i) + F8::Load(p + i) * b).Store(p + i);
  }
}

inline void AdvanceFields(float alpha, const float* p, const float* q, float* d, float* r, std::size_t count) {
  const F8 a = F8::All(alpha);
  for (std::size_t i = 0; i < count; i += 8) {
    (F8::Load(d + i) + F8::Load(p + i) * a).Store(d + i);
    (F8::Load(r + i) - F8::Load(q + i) * a).Store(r + i);
  }
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
