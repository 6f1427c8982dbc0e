// Bodies of the membrane's kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set.
#pragma once

#include "physics_node/accurate/kernels.h"
#include "physics_node/pbd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using accurate::Inertia;
using accurate::kHatMass;
using accurate::Middle;
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

/// What the edges of one row hand to the row below, per slot: N vectors for the node below and N for the one below
/// right. Two rows of it, used in turn.
template <int N>
struct Below {
  float* row[2];
  std::size_t stride;
  int now = 0;
  Below(float* memory, std::size_t row_stride) : row{memory, memory + 2 * N * row_stride}, stride(row_stride) {
    for (std::size_t i = 0; i < 2 * N * stride; i += 8) {
      F8::All(0).Store(row[0] + i);
    }
  }
  void Swap() { now = 1 - now; }
  /// Component c of what goes straight down (way 0) or down right (way 1) from slot `at`.
  void Put(int c, int way, std::size_t at, F8 v) const {
    v.Store(row[1 - now] + static_cast<std::size_t>(2 * c + way) * stride + at);
  }
  /// What arrives at slot `at` from the row above.
  [[nodiscard]] F8 Get(int c, std::size_t at, std::size_t last) const {
    const float* straight = row[now] + static_cast<std::size_t>(2 * c) * stride;
    const float* diagonal = straight + stride;
    return F8::Load(straight + at) + (at == 0 ? RotateUp(F8::Load(diagonal + last)) : F8::Load(diagonal + at - 8));
  }
};

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
/// Force of an edge on its first node, and the six entries of its block.
struct Edge9 {
  F8 v[9];
};
inline Edge9 MakeEdge(const Spring8& spring, const Stiffness8& k) {
  const V8 f = spring.direction * spring.tension;
  return {{f.x, f.y, f.z, k.kt + k.m.x * k.m.x, k.kt + k.m.y * k.m.y, k.kt + k.m.z * k.m.z, k.m.x * k.m.y,
           k.m.x * k.m.z, k.m.y * k.m.z}};
}

/// Edges of one row. Sums of forces and blocks of its nodes go to `sums` [9][stride], what belongs to the next row into
/// `below`; with `only_below` nothing else is done.
inline void LineariseRow(const Sheet& sheet, const SheetLinearise& at, const SheetMatrix& matrix, const Below<9>& below,
                         float* sums, int row, bool only_below) {
  const std::size_t start = RowStart(sheet, row), stride = 8 * static_cast<std::size_t>(sheet.slots);
  const std::size_t last = stride - 8;
  const F8 stiffening = F8::All(sheet.stiffening), zero = F8::All(0);
  Edge9 left;  // The edge that comes in from the slot before.
  for (F8& v : left.v) {
    v = zero;
  }
  for (int s = 0; s < sheet.slots; ++s) {
    const std::size_t slot = 8 * static_cast<std::size_t>(s), node = start + slot;
    const V8 x = LoadV(at.place, node);
    const Ends ends = LoadEnds(sheet, at.place, node, s, row + 1 == sheet.rows);
    const V8 other[3] = {ends.right, ends.below, ends.diagonal};
    Edge9 edges[3];
    for (int d = only_below ? 1 : 0; d < 3; ++d) {
      const F8 inverse_rest = F8::Load(sheet.inverse_rest[d] + node), axial = F8::Load(sheet.axial[d] + node);
      const Spring8 spring = Stretch(other[d] - x, inverse_rest, axial, stiffening);
      const Stiffness8 k = EdgeStiffness(spring, inverse_rest, axial, stiffening);
      edges[d] = MakeEdge(spring, k);
      if (!only_below) {
        StoreV(k.m, matrix.m[d], node);
        k.kt.Store(matrix.kt[d] + node);
      }
    }
    for (int c = 0; c < 9; ++c) {
      const F8 sign = F8::All(c < 3 ? -1.0f : 1.0f);  // Forces act on the other end the other way.
      below.Put(c, 0, slot, sign * edges[1].v[c]);
      below.Put(c, 1, slot, sign * edges[2].v[c]);
      if (!only_below) {
        const F8 own = (edges[0].v[c] + edges[1].v[c]) + edges[2].v[c];
        ((own + left.v[c]) + below.Get(c, slot, last)).Store(sums + static_cast<std::size_t>(c) * stride + slot);
        left.v[c] = sign * edges[0].v[c];
      }
    }
  }
  if (!only_below) {
    for (int c = 0; c < 9; ++c) {
      float* first = sums + static_cast<std::size_t>(c) * stride;
      (F8::Load(first) + RotateUp(left.v[c])).Store(first);
    }
  }
}

inline void StoreInverseBlock(const F8 a[6], float* const block[6], std::size_t at) {
  const F8 xx = a[0], yy = a[1], zz = a[2], xy = a[3], xz = a[4], yz = a[5];
  const F8 c00 = yy * zz - yz * yz, c01 = xz * yz - xy * zz, c02 = xy * yz - xz * yy;
  const F8 c11 = xx * zz - xz * xz, c12 = xy * xz - xx * yz, c22 = xx * yy - xy * xy;
  const F8 scale = F8::All(1.0f) / (xx * c00 + xy * c01 + xz * c02);
  const F8 inverse[6] = {c00 * scale, c11 * scale, c22 * scale, c01 * scale, c02 * scale, c12 * scale};
  for (int i = 0; i < 6; ++i) {
    inverse[i].Store(block[i] + at);
  }
}

inline void SheetLineariseRows(const Sheet& sheet, const Inertia& inertia, const SheetLinearise& at,
                               const SheetMatrix& matrix, float* memory, int row0, int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  Below<9> below(memory, stride);
  float* sums = memory + 36 * stride;
  if (row0 > 0) {
    LineariseRow(sheet, at, matrix, below, sums, row0 - 1, true);
    below.Swap();
  }
  const F8 zero = F8::All(0), k = F8::All(inertia.inertia), inverse_h = F8::All(1.0f / inertia.h);
  const V8 gravity = {F8::All(inertia.gravity[0]), F8::All(inertia.gravity[1]), F8::All(inertia.gravity[2])};
  for (int row = row0; row < row1; ++row) {
    LineariseRow(sheet, at, matrix, below, sums, row, false);
    const auto sum = [&](int c, std::size_t slot) {
      return F8::Load(sums + static_cast<std::size_t>(c) * stride + slot);
    };
    const std::size_t start = RowStart(sheet, row);
    for (std::size_t slot = 0; slot < stride; slot += 8) {
      const std::size_t node = start + slot;
      const F8 moves = F8::Load(sheet.w + node) > zero, mass = F8::Load(sheet.mass + node) & moves;
      const V8 moved = LoadV(at.place, node) - LoadV(at.start, node);
      const V8 momentum = moved * k - LoadV(at.velocity, node) * inverse_h;
      const V8 elastic = {sum(0, slot), sum(1, slot), sum(2, slot)};
      StoreV(elastic + LoadV(at.load, node) + (gravity - momentum) * mass, at.residual, node);
      const F8 own = F8::Load(at.extra + node) + mass * k;
      const F8 block[6] = {sum(3, slot) + own, sum(4, slot) + own, sum(5, slot) + own,
                           sum(6, slot),       sum(7, slot),       sum(8, slot)};
      StoreInverseBlock(block, matrix.block, node);
      for (float* plane : matrix.block) {
        (F8::Load(plane + node) & moves).Store(plane + node);
      }
    }
    below.Swap();
  }
}

/// K p of one row's edges into `out`, what belongs to the next row into `below`. Returns the sum of p^T K p over the
/// edges that the row owns.
inline F8 ApplyRow(const Sheet& sheet, const SheetMatrix& matrix, const float* const p[3], const Below<3>& below,
                   float* const out[3], int row, bool only_below) {
  const std::size_t start = RowStart(sheet, row), last = 8 * static_cast<std::size_t>(sheet.slots) - 8;
  F8 sum = F8::All(0);
  V8 left = ZeroV();
  for (int s = 0; s < sheet.slots; ++s) {
    const std::size_t slot = 8 * static_cast<std::size_t>(s), node = start + slot;
    const V8 here = LoadV(p, node);
    const Ends ends = LoadEnds(sheet, p, node, s, row + 1 == sheet.rows);
    const V8 other[3] = {ends.right, ends.below, ends.diagonal};
    V8 force[3];
    for (int d = only_below ? 1 : 0; d < 3; ++d) {
      const V8 m = LoadV(matrix.m[d], node), dp = other[d] - here;
      force[d] = dp * F8::Load(matrix.kt[d] + node) + m * Dot(m, dp);
      sum = sum + Dot(dp, force[d]);
    }
    const F8* const down[3] = {&force[1].x, &force[1].y, &force[1].z};
    const F8* const diagonal[3] = {&force[2].x, &force[2].y, &force[2].z};
    for (int c = 0; c < 3; ++c) {
      below.Put(c, 0, slot, *down[c]);
      below.Put(c, 1, slot, *diagonal[c]);
    }
    if (!only_below) {
      const V8 above = {below.Get(0, slot, last), below.Get(1, slot, last), below.Get(2, slot, last)};
      StoreV((left + above) - ((force[0] + force[1]) + force[2]), out, node);
      left = force[0];
    }
  }
  if (!only_below) {
    StoreV(LoadV(out, start) + UpV(left), out, start);
  }
  return sum;
}

inline double SheetApply(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                         float* const out[3], float* memory, int row0, int row1) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  Below<3> below(memory, stride);
  if (row0 > 0) {
    (void)ApplyRow(sheet, matrix, p, below, out, row0 - 1, true);
    below.Swap();
  }
  double sum = 0;
  const F8 k = F8::All(inertia), zero = F8::All(0);
  for (int row = row0; row < row1; ++row) {
    F8 dot = ApplyRow(sheet, matrix, p, below, out, row, false);
    const std::size_t start = RowStart(sheet, row);
    for (std::size_t slot = 0; slot < stride; slot += 8) {
      const std::size_t node = start + slot;
      const F8 mass = (F8::Load(sheet.mass + node) & (F8::Load(sheet.w + node) > zero)) * k;
      const V8 here = LoadV(p, node), inertial = here * mass;
      dot = dot + Dot(here, inertial);
      StoreV(LoadV(out, node) + inertial, out, node);
    }
    sum += SumOf(dot);
    below.Swap();
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

/// Blocks of the middle level's functions, inverted. Each is a hat of +-4 rows and slots; sum (d hat)^2 over its edges
/// is 11/8 along rows and columns and 11/4 along diagonals, and the edges are sampled at and around its centre.
inline void MiddleBlocks(const Sheet& sheet, const Middle& middle, const SheetMatrix& matrix, float inertia) {
  const std::size_t stride = 8 * static_cast<std::size_t>(sheet.slots);
  const F8 zero = F8::All(0), k = F8::All(inertia * kHatMass);
  for (int r = 0; r < middle.rows; ++r) {
    const int centre = middle.centre[r];
    for (int s = 0; s < middle.slots; ++s) {
      F8 block[6] = {zero, zero, zero, zero, zero, zero};
      F8 mass = zero;
      for (int sample = 0; sample < 4; ++sample) {
        int row = centre + (sample < 2 ? -1 : 1), slot = 4 * s + (sample & 1);
        row = row < 0 ? 0 : row >= sheet.rows ? sheet.rows - 1 : row;
        slot = slot < sheet.slots ? slot : sheet.slots - 1;
        const std::size_t at = static_cast<std::size_t>(row) * stride + 8 * static_cast<std::size_t>(slot);
        for (int d = 0; d < 3; ++d) {
          const F8 share = F8::All((d == 2 ? 2.75f : 1.375f) / 4.0f), kt = F8::Load(matrix.kt[d] + at);
          const V8 m = LoadV(matrix.m[d], at);
          block[0] = block[0] + share * (kt + m.x * m.x);
          block[1] = block[1] + share * (kt + m.y * m.y);
          block[2] = block[2] + share * (kt + m.z * m.z);
          block[3] = block[3] + share * (m.x * m.y);
          block[4] = block[4] + share * (m.x * m.z);
          block[5] = block[5] + share * (m.y * m.z);
        }
        mass = mass + F8::Load(sheet.mass + at);
      }
      const std::size_t to = 8 * static_cast<std::size_t>(r * middle.slots + s);
      // A sheet that hangs on nothing still has its mass; without mass and edges there is no residual either.
      const F8 own = Max(mass * F8::All(0.25f) * k, F8::All(1e-3f));
      for (int i = 0; i < 3; ++i) {
        block[i] = block[i] + own;
      }
      StoreInverseBlock(block, middle.block, to);
      // A hat on a node that does not move has only part of its edges, and the samples are not of that part.
      const int last = 4 * s < sheet.slots ? 4 * s : sheet.slots - 1;
      const F8 moves = F8::Load(sheet.w + RowStart(sheet, centre) + 8 * static_cast<std::size_t>(last)) > zero;
      for (float* plane : middle.block) {
        (F8::Load(plane + to) & moves).Store(plane + to);
      }
    }
  }
}

/// sums [row][axis][middle slots * 8] <- what a row's residual gives to the middle level's slots.
inline void SheetRestrict(const Sheet& sheet, const Middle& middle, const float* const r[3], float* sums, int row0,
                          int row1) {
  const std::size_t width = 8 * static_cast<std::size_t>(middle.slots);
  const F8 zero = F8::All(0);
  for (int row = row0; row < row1; ++row) {
    float* out = sums + 3 * width * static_cast<std::size_t>(row);
    V8 carried = ZeroV();  // From the group before; into the first from the last, one lane on.
    for (int s1 = 0; s1 < middle.slots; ++s1) {
      V8 own = carried;
      carried = ZeroV();
      for (int s = 4 * s1, end = s + 4 < sheet.slots ? s + 4 : sheet.slots; s < end; ++s) {
        const std::size_t node = RowStart(sheet, row) + 8 * static_cast<std::size_t>(s);
        const F8 moves = F8::Load(sheet.w + node) > zero;
        V8 v = LoadV(r, node);
        v = {v.x & moves, v.y & moves, v.z & moves};
        own = own + v * F8::Load(middle.own + 8 * s);
        carried = carried + v * F8::Load(middle.next + 8 * s);
      }
      float* const to[3] = {out, out + width, out + 2 * width};
      StoreV(own, to, 8 * static_cast<std::size_t>(s1));
    }
    float* const first[3] = {out, out + width, out + 2 * width};
    StoreV(LoadV(first, 0) + UpV(carried), first, 0);
  }
}

inline double SheetPrecondition(const Sheet& sheet, const Middle& middle, const SheetMatrix& matrix,
                                const float* const r[3], float* const z[3], int row0, int row1) {
  const std::size_t width = 8 * static_cast<std::size_t>(middle.slots);
  const F8 zero = F8::All(0);
  double sum = 0;
  for (int row = row0; row < row1; ++row) {
    const float* low = middle.value + 3 * width * static_cast<std::size_t>(middle.cell[row]);
    const float* high = middle.fraction[row] > 0.0f ? low + 3 * width : low;
    const F8 up = F8::All(middle.fraction[row]), down = F8::All(1.0f - middle.fraction[row]);
    const auto value = [&](int s1) {
      const std::size_t at = 8 * static_cast<std::size_t>(s1);
      const float* const a[3] = {low, low + width, low + 2 * width};
      const float* const b[3] = {high, high + width, high + 2 * width};
      return LoadV(a, at) * down + LoadV(b, at) * up;
    };
    F8 dot = zero;
    V8 here = value(0);
    for (int s1 = 0; s1 < middle.slots; ++s1) {
      const V8 following = s1 + 1 < middle.slots ? value(s1 + 1) : DownV(value(0));
      for (int s = 4 * s1, end = s + 4 < sheet.slots ? s + 4 : sheet.slots; s < end; ++s) {
        const std::size_t node = RowStart(sheet, row) + 8 * static_cast<std::size_t>(s);
        const V8 far = here * F8::Load(middle.own + 8 * s) + following * F8::Load(middle.next + 8 * s);
        const F8 moves = F8::Load(sheet.w + node) > zero;
        const V8 b = LoadV(r, node);
        const F8 xx = F8::Load(matrix.block[0] + node), yy = F8::Load(matrix.block[1] + node),
                 zz = F8::Load(matrix.block[2] + node), xy = F8::Load(matrix.block[3] + node),
                 xz = F8::Load(matrix.block[4] + node), yz = F8::Load(matrix.block[5] + node);
        const V8 near = {xx * b.x + xy * b.y + xz * b.z, xy * b.x + yy * b.y + yz * b.z,
                         xz * b.x + yz * b.y + zz * b.z};
        const V8 result = {near.x + (far.x & moves), near.y + (far.y & moves), near.z + (far.z & moves)};
        StoreV(result, z, node);
        dot = dot + Dot(b, result);
      }
      here = following;
    }
    sum += SumOf(dot);
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

inline float Largest(const float* d, std::size_t plane, std::size_t count) {
  F8 largest = F8::All(0);
  for (std::size_t i = 0; i < count; i += 8) {
    const V8 v = {F8::Load(d + i), F8::Load(d + plane + i), F8::Load(d + 2 * plane + i)};
    largest = Max(Dot(v, v), largest);
  }
  return LargestOf(largest);
}

inline accurate::FinishCount FinishSheet(const float* const place[3], const float* const d[3], const float* w, float h,
                                         float speed, float* const x[3], float* const velocity[3], std::size_t count) {
  const F8 zero = F8::All(0), step = F8::All(h), inverse_h = F8::All(1.0f / h);
  const F8 limit = F8::All(speed), limit_sq = F8::All(speed * speed);
  F8 largest = zero;
  std::uint32_t resets = 0;
  for (std::size_t i = 0; i < count; i += 8) {
    const V8 from = LoadV(x, i);
    V8 v = ((LoadV(place, i) + LoadV(d, i)) - from) * inverse_h;
    const F8 square = Dot(v, v), moves = F8::Load(w + i) > zero;
    const F8 finite = square < F8::All(1e30f);
    resets += static_cast<std::uint32_t>(__builtin_popcount(Bits(moves) & ~Bits(finite) & 0xffu));
    const F8 part = Select(square > limit_sq, limit / Sqrt(square), F8::All(1.0f));
    v = {(v.x * part) & finite, (v.y * part) & finite, (v.z * part) & finite};
    largest = Max(Min(square & finite, limit_sq) & moves, largest);
    StoreV(v, velocity, i);
    StoreV(from + v * step, x, i);
  }
  return {LargestOf(largest), resets};
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
