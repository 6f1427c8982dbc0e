// Bodies of the kernels of the preconditioner's lower levels over the membrane: blocks of the diagonal and the middle
// level. Compiled once per instruction set, after sheet_kernels_impl.h.
#pragma once

#include "physics_node/implicit/sheet_kernels_impl.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using implicit::kFactorBlock;
using implicit::kHatMass;
using implicit::Middle;
using implicit::Substitution;

/// Blocks of the middle level's functions, inverted. Each is a hat of +-4 rows and slots; sum (d hat)^2 over its edges
/// is 11/8 along rows and columns and 11/4 along diagonals, and the edges are sampled at and around its centre.
inline void MiddleBlocks(const Sheet& sheet, const Middle& middle, const SheetMatrix& matrix, float inertia, int first,
                         int end) {
  const F8 zero = F8::All(0), k = F8::All(inertia * kHatMass);
  for (int r = first; r < end; ++r) {
    const int centre = middle.centre[r];
    for (int s = 0; s < middle.slots; ++s) {
      F8 block[6] = {zero, zero, zero, zero, zero, zero};
      F8 mass = zero;
      for (int sample = 0; sample < 4; ++sample) {
        int row = centre + (sample < 2 ? -1 : 1), slot = 4 * s + (sample & 1);
        row = row < 0 ? 0 : row >= sheet.rows ? sheet.rows - 1 : row;
        slot = slot < sheet.slots ? slot : sheet.slots - 1;
        const std::size_t at = RowStart(sheet, row) + 8 * static_cast<std::size_t>(slot);
        const V8 x = LoadV(matrix.place, at);
        const Ends ends = LoadEnds(sheet, matrix.place, at, slot, row + 1 == sheet.rows);
        const V8 other[3] = {ends.right, ends.below, ends.diagonal};
        for (int d = 0; d < 3; ++d) {
          const F8 share = F8::All((d == 2 ? 2.75f : 1.375f) / 4.0f), kt = F8::Load(matrix.kt[d] + at) * share;
          const V8 e = other[d] - x, a = e * (F8::Load(matrix.along[d] + at) * share);
          block[0] = block[0] + (kt + a.x * e.x);
          block[1] = block[1] + (kt + a.y * e.y);
          block[2] = block[2] + (kt + a.z * e.z);
          block[3] = block[3] + a.x * e.y;
          block[4] = block[4] + a.x * e.z;
          block[5] = block[5] + a.y * e.z;
        }
        mass = mass + F8::Load(sheet.mass + at);
      }
      // A sheet that hangs on nothing still has its mass; without mass and edges there is no residual either.
      const std::size_t to = 8 * static_cast<std::size_t>(r * middle.slots + s);
      const F8 scale = F8::Load(middle.scale + to);
      const F8 own = Max(mass * F8::All(0.25f) * k, F8::All(1e-3f));
      for (int i = 0; i < 6; ++i) {
        block[i] = i < 3 ? block[i] * scale + own : block[i] * scale;
      }
      // A hat on a node that does not move has only part of its edges, and the samples are not of that part.
      const int last = 4 * s < sheet.slots ? 4 * s : sheet.slots - 1;
      const F8 moves = F8::Load(sheet.w + RowStart(sheet, centre) + 8 * static_cast<std::size_t>(last)) > zero;
      StoreInverseBlock(block, moves & (scale > zero), middle.block, to);
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

FULCRUM_INLINE V8 BlockProduct(const SheetMatrix& matrix, std::size_t node, V8 b) {
  const F8 xx = F8::Load(matrix.block[0] + node), yy = F8::Load(matrix.block[1] + node),
           zz = F8::Load(matrix.block[2] + node), xy = F8::Load(matrix.block[3] + node),
           xz = F8::Load(matrix.block[4] + node), yz = F8::Load(matrix.block[5] + node);
  return {xx * b.x + xy * b.y + xz * b.z, xy * b.x + yy * b.y + yz * b.z, xz * b.x + yz * b.y + zz * b.z};
}

inline double SheetBlockSolve(const Sheet& sheet, const SheetMatrix& matrix, const float* const r[3], float* const z[3],
                              int row0, int row1) {
  double sum = 0;
  for (int row = row0; row < row1; ++row) {
    F8 dot = F8::All(0);
    for (std::size_t node = RowStart(sheet, row), end = RowStart(sheet, row + 1); node < end; node += 8) {
      const V8 b = LoadV(r, node), result = BlockProduct(matrix, node, b);
      StoreV(result, z, node);
      dot = dot + Dot(b, result);
    }
    sum += SumOf(dot);
  }
  return sum;
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
        const V8 b = LoadV(r, node), near = BlockProduct(matrix, node, b);
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

/// out <- out - block y, or block y when `set`; the products of a row one after the other.
template <bool kSet>
FULCRUM_INLINE void TakeBlock(const float* block, const float* y, float* out) {
  constexpr int kWidth = 8 * Widest::kBatches, kParts = kFactorBlock / kWidth;
  Widest sum[kParts];
  for (int i = 0; i < kParts; ++i) {
    sum[i] = kSet ? Widest::All(0) : Widest::Load(out + kWidth * i);
  }
  for (int j = 0; j < kFactorBlock; ++j) {
    const Widest factor = Widest::All(y[j]);
    for (int i = 0; i < kParts; ++i) {
      const Widest product = Widest::Load(block + kFactorBlock * j + kWidth * i) * factor;
      sum[i] = kSet ? sum[i] + product : sum[i] - product;
    }
  }
  for (int i = 0; i < kParts; ++i) {
    sum[i].Store(out + kWidth * i);
  }
}

/// Four columns of the product at a time, each summed over the columns of `b` in their order.
inline void BlockProduct(const float* b, const float* c, bool take_off, float* a) {
  constexpr int kColumns = 4, kRows = kFactorBlock / (8 * Widest::kBatches);
  constexpr std::size_t kWide = std::size_t{8} * Widest::kBatches;
  for (std::size_t j = 0; j < kFactorBlock; j += kColumns) {
    Widest sum[kColumns][kRows];
    for (std::size_t k = 0; k < kFactorBlock; ++k) {
      for (std::size_t i = 0; i < kColumns; ++i) {
        const Widest factor = Widest::All(c[kFactorBlock * k + j + i]);
        for (std::size_t r = 0; r < kRows; ++r) {
          const Widest term = Widest::Load(b + kFactorBlock * k + kWide * r) * factor;
          sum[i][r] = k == 0 ? term : sum[i][r] + term;
        }
      }
    }
    for (std::size_t i = 0; i < kColumns; ++i) {
      for (std::size_t r = 0; r < kRows; ++r) {
        float* const out = a + kFactorBlock * (j + i) + kWide * r;
        (take_off ? Widest::Load(out) - sum[i][r] : sum[i][r]).Store(out);
      }
    }
  }
}

inline void Substitute(const Substitution& order, const float* blocks, float* x) {
  constexpr std::size_t kFloats = std::size_t{kFactorBlock} * kFactorBlock;
  alignas(64) float y[kFactorBlock];
  for (int step = 0; step < order.steps; ++step) {
    const std::uint32_t first = order.start[step], end = order.start[step + 1];
    float* own = x + std::size_t{kFactorBlock} * order.block[first];
    TakeBlock<true>(blocks + kFloats * first, own, y);
    for (int i = 0; i < kFactorBlock; ++i) {
      own[i] = y[i];
    }
    for (std::uint32_t later = first + 1; later < end; ++later) {
      TakeBlock<false>(blocks + kFloats * later, y, x + std::size_t{kFactorBlock} * order.block[later]);
    }
  }
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
