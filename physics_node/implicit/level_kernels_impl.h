// Kernels of the preconditioner's levels over the membrane: blocks of the diagonal and hats; and of the coarse factor.
// Compiled once per instruction set, after sheet_kernels_impl.h.
//
//   z = D^-1 r + H (B^-1 H^T r + C)
//
//   r, z  residual [N] and preconditioned residual [m]
//   D     3 x 3 blocks of the diagonal [N/m], their inverses in SheetMatrix::block
//   H     hats: H_ns = w(row) w(column), w = 1 - |distance| / 4 from node n to the middle of hat s, 0 from 4 on
//   B     blocks of H^T A H. The sum of K (dH)^2 over edges is sampled at four nodes (row of the middle +- 1; slots 4 i
//         and 4 i + 1):   B ~ scale sum_samples sum_d (e_d / 4) K_d + s (11/4)^2 (mean mass) I
//   e_d   sum of (dH)^2 over the edges of kind d (kHatStraightEdges, kHatDiagonalEdges)
//   K_d   stiffness of the edge of kind d at a sample [N/m]; s = (1 + damping h) / h^2 [1/s^2]
//   C     what the coarse nodes add to a hat, already in HatLevel::value [m] (coarse_solve.cc)
//
// Layout. A row of hats is every fourth slot of the sheet, so transfers along a row need no gather: a slot of the sheet
// gives to the slot of hats before it (`own`) and to the one after it (`next`), the last one to the first, one lane on:
//
//   slot of the sheet   0    1    2    3  | 4    5  ...      row_sums [row][axis][hat slots * 8]
//   slot of hats        0                 | 1                value    [hat row][axis][hat slots * 8]
//   own                 1   3/4  1/2  1/4 | 1                block    [6][hat row][hat slots * 8]
//   next                0   1/4  1/2  3/4 | 0
//
// Coarse factor: blocks of 16 x 16 floats by columns; a column is one register of AVX-512, two of AVX2.
//   product       A <- B C^T, or A - B C^T
//   substitution  y = T_kk^-1 x_k;  x_i -= T_ik y for the blocks i below k that are not zero;  x_k = y
#pragma once

#include "physics_node/implicit/sheet_kernels_impl.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using implicit::HatLevel;
using implicit::kFactorBlock;
using implicit::kFactorBlockFloats;
using implicit::kHatDiagonalEdges;
using implicit::kHatMass;
using implicit::kHatSamples;
using implicit::kHatSpacing;
using implicit::kHatStraightEdges;
using implicit::Substitution;

/// Least inertia of a block of hats [N/m]: a hat without mass and edges has no residual, and its block stays regular.
constexpr float kLeastHatBlock_N_per_m = 1e-3f;

inline void HatBlocks(const Sheet& sheet, const HatLevel& hats, const SheetMatrix& matrix, float inertia, int first,
                      int end) {
  const F8 zero = F8::All(0), k = F8::All(inertia * kHatMass);
  for (int r = first; r < end; ++r) {
    const int centre = hats.centre[r];
    for (int s = 0; s < hats.slots; ++s) {
      F8 block[6] = {zero, zero, zero, zero, zero, zero};
      F8 mass = zero;
      for (int sample = 0; sample < kHatSamples; ++sample) {
        int row = centre + (sample < 2 ? -1 : 1), slot = kHatSpacing * s + (sample & 1);
        row = row < 0 ? 0 : row >= sheet.rows ? sheet.rows - 1 : row;
        slot = slot < sheet.slots ? slot : sheet.slots - 1;
        const std::size_t at = RowStart(sheet, row) + kLanes * static_cast<std::size_t>(slot);
        const V8 x = LoadV(matrix.point, at);
        const Ends ends = LoadEnds(sheet, matrix.point, at, slot, row + 1 == sheet.rows);
        const V8 far_end[3] = {ends.right, ends.below, ends.diagonal};
        for (int d = 0; d < 3; ++d) {
          const F8 share = F8::All((d == 2 ? kHatDiagonalEdges : kHatStraightEdges) / float{kHatSamples}),
                   kt = F8::Load(matrix.kt[d] + at) * share;
          const V8 e = far_end[d] - x, a = e * (F8::Load(matrix.along[d] + at) * share);
          block[0] = block[0] + (kt + a.x * e.x);
          block[1] = block[1] + (kt + a.y * e.y);
          block[2] = block[2] + (kt + a.z * e.z);
          block[3] = block[3] + a.x * e.y;
          block[4] = block[4] + a.x * e.z;
          block[5] = block[5] + a.y * e.z;
        }
        mass = mass + F8::Load(sheet.mass + at);
      }
      const std::size_t to = kLanes * static_cast<std::size_t>(r * hats.slots + s);
      const F8 scale = F8::Load(hats.scale + to);
      const F8 own = Max(mass * F8::All(1.0f / float{kHatSamples}) * k, F8::All(kLeastHatBlock_N_per_m));
      for (int i = 0; i < 6; ++i) {
        block[i] = i < 3 ? block[i] * scale + own : block[i] * scale;
      }
      // A hat on a node that does not move has only part of its edges, and the samples are not of that part.
      const int last = kHatSpacing * s < sheet.slots ? kHatSpacing * s : sheet.slots - 1;
      const F8 moves = F8::Load(sheet.w + RowStart(sheet, centre) + kLanes * static_cast<std::size_t>(last)) > zero;
      StoreInverseBlock(block, moves & (scale > zero), hats.block, to);
    }
  }
}

inline void SheetRestrict(const Sheet& sheet, const HatLevel& hats, const float* const r[3], float* sums, int row0,
                          int row1) {
  const std::size_t width = kLanes * static_cast<std::size_t>(hats.slots);
  const F8 zero = F8::All(0);
  for (int row = row0; row < row1; ++row) {
    float* out = sums + 3 * width * static_cast<std::size_t>(row);
    V8 carried = ZeroV();  // From the group before; into the first from the last, one lane on.
    for (int s1 = 0; s1 < hats.slots; ++s1) {
      V8 own = carried;
      carried = ZeroV();
      for (int s = kHatSpacing * s1, end = s + kHatSpacing < sheet.slots ? s + kHatSpacing : sheet.slots; s < end;
           ++s) {
        const std::size_t node = RowStart(sheet, row) + kLanes * static_cast<std::size_t>(s);
        const F8 moves = F8::Load(sheet.w + node) > zero;
        V8 v = LoadV(r, node);
        v = {v.x & moves, v.y & moves, v.z & moves};
        own = own + v * F8::Load(hats.own + kLanes * s);
        carried = carried + v * F8::Load(hats.next + kLanes * s);
      }
      float* const to[3] = {out, out + width, out + 2 * width};
      StoreV(own, to, kLanes * static_cast<std::size_t>(s1));
    }
    float* const first[3] = {out, out + width, out + 2 * width};
    StoreV(LoadV(first, 0) + UpV(carried), first, 0);
  }
}

FULCRUM_INLINE V8 MultiplyBlock(const SheetMatrix& matrix, std::size_t node, V8 b) {
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
    for (std::size_t node = RowStart(sheet, row), end = RowStart(sheet, row + 1); node < end; node += kLanes) {
      const V8 b = LoadV(r, node), result = MultiplyBlock(matrix, node, b);
      StoreV(result, z, node);
      dot = dot + Dot(b, result);
    }
    sum += SumOf(dot);
  }
  return sum;
}

inline double SheetPrecondition(const Sheet& sheet, const HatLevel& hats, const SheetMatrix& matrix,
                                const float* const r[3], float* const z[3], int row0, int row1) {
  const std::size_t width = kLanes * static_cast<std::size_t>(hats.slots);
  const F8 zero = F8::All(0);
  double sum = 0;
  for (int row = row0; row < row1; ++row) {
    const float* low = hats.value + 3 * width * static_cast<std::size_t>(hats.cell[row]);
    const float* high = hats.fraction[row] > 0.0f ? low + 3 * width : low;
    const F8 up = F8::All(hats.fraction[row]), down = F8::All(1.0f - hats.fraction[row]);
    const auto value = [&](int s1) {
      const std::size_t at = kLanes * static_cast<std::size_t>(s1);
      const float* const a[3] = {low, low + width, low + 2 * width};
      const float* const b[3] = {high, high + width, high + 2 * width};
      return LoadV(a, at) * down + LoadV(b, at) * up;
    };
    F8 dot = zero;
    V8 here = value(0);
    for (int s1 = 0; s1 < hats.slots; ++s1) {
      const V8 following = s1 + 1 < hats.slots ? value(s1 + 1) : DownV(value(0));
      for (int s = kHatSpacing * s1, end = s + kHatSpacing < sheet.slots ? s + kHatSpacing : sheet.slots; s < end;
           ++s) {
        const std::size_t node = RowStart(sheet, row) + kLanes * static_cast<std::size_t>(s);
        const V8 from_hats = here * F8::Load(hats.own + kLanes * s) + following * F8::Load(hats.next + kLanes * s);
        const F8 moves = F8::Load(sheet.w + node) > zero;
        const V8 b = LoadV(r, node), own = MultiplyBlock(matrix, node, b);
        const V8 result = {own.x + (from_hats.x & moves), own.y + (from_hats.y & moves), own.z + (from_hats.z & moves)};
        StoreV(result, z, node);
        dot = dot + Dot(b, result);
      }
      here = following;
    }
    sum += SumOf(dot);
  }
  return sum;
}

/// out <- out - block y, or block y when `kSet`; the products of a row one after the other.
template <bool kSet>
FULCRUM_INLINE void SubtractProduct(const float* block, const float* y, float* out) {
  constexpr int kWidth = kLanes * Widest::kBatches, kParts = kFactorBlock / kWidth;
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
inline void BlockProduct(const float* b, const float* c, bool subtract, float* a) {
  constexpr int kColumns = 4, kRows = kFactorBlock / (kLanes * Widest::kBatches);
  constexpr std::size_t kWide = std::size_t{kLanes} * Widest::kBatches;
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
        (subtract ? Widest::Load(out) - sum[i][r] : sum[i][r]).Store(out);
      }
    }
  }
}

inline void Substitute(const Substitution& order, const float* blocks, float* x) {
  alignas(64) float y[kFactorBlock];
  for (int step = 0; step < order.steps; ++step) {
    const std::uint32_t first = order.start[step], end = order.start[step + 1];
    float* own = x + std::size_t{kFactorBlock} * order.block[first];
    SubtractProduct<true>(blocks + kFactorBlockFloats * first, own, y);
    for (int i = 0; i < kFactorBlock; ++i) {
      own[i] = y[i];
    }
    for (std::uint32_t later = first + 1; later < end; ++later) {
      SubtractProduct<false>(blocks + kFactorBlockFloats * later, y,
                             x + std::size_t{kFactorBlock} * order.block[later]);
    }
  }
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
