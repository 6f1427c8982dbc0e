// The membrane as a continuum (energy/triangle_energy.h), in floats and a register of triangles at a time. Included by
// sheet_rows_impl.h and sheet_kernels_impl.h.
//
// A cell of the grid has two triangles, both owned by its first node (r, c):
//
//   (r, c) ──R── (r, c+1)       0: R, B', D      tension of an edge   t_i  = 2 dE/dl_i         [N/m]
//     │  ╲   0   |               1: R', B, D      stiffness            4 H_ij d_i d_j^T         [N/m^3] (d d^T)
//     B    D     B'
//     │ 1    ╲   |              D = diagonal, B' = D - R, R' = D - B
//   (r+1, c) ─R'─ (r+1, c+1)
//
// Own parts, t_i and 4 H_ii, are added to those of the edge, which a node owns: those of B' are handed on along the
// row, those of R' to the row below. The coupling of two edges, 4 H_ij, stays with the triangle.
#pragma once

#include "physics_node/implicit/kernels.h"
#include "physics_node/simd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using implicit::kLeastSheetDeterminant;
using implicit::Sheet;

/// Vectors along the edges of the two triangles of a cell: along the row, down the column, diagonal.
template <class F>
struct CellEdges {
  V<F> of[2][3];
};
template <class F>
FULCRUM_INLINE CellEdges<F> EdgesOfCell(const V<F>& right, const V<F>& down, const V<F>& diagonal) {
  return {{{right, diagonal - right, diagonal}, {diagonal - down, down, diagonal}}};
}

template <class F>
struct TriangleLaw {
  F half_g, f1, f2, weight, scale, invariant;
  F slope[3], first[3];
  F curve, curve_own;  ///< f' d2 det C / dl_i dl_j: of two edges, and of one.
};
template <class F>
FULCRUM_INLINE TriangleLaw<F> LawOf(const Sheet& sheet, int half, std::size_t node, const V<F> edge[3]) {
  const F one = F::All(1.0f), two = F::All(2.0f), least = F::All(kLeastSheetDeterminant), zero = F::All(0);
  F alpha[3], l[3];
  for (int i = 0; i < 3; ++i) {
    alpha[i] = F::Load(sheet.trace[half][i] + node);
    l[i] = Dot(edge[i], edge[i]);
  }
  TriangleLaw<F> law;
  law.scale = F::Load(sheet.triangle[half] + node);
  law.half_g = F::All(0.5f) * (alpha[0] * alpha[1] + alpha[1] * alpha[2] + alpha[2] * alpha[0]);
  const F sum = l[0] + l[1] + l[2];
  F twice_determinant = zero, trace = zero;
  for (int i = 0; i < 3; ++i) {
    law.slope[i] = law.half_g * (sum - two * l[i]);
    twice_determinant = twice_determinant + law.slope[i] * l[i];
    trace = trace + alpha[i] * l[i];
  }
  const F determinant = F::All(0.5f) * twice_determinant, at = Max(determinant, least), inverse = one / at;
  law.f1 = zero - inverse * inverse;
  law.invariant = trace + inverse + law.f1 * (determinant - at) - F::All(3.0f);
  law.weight = one + F::All(2.0f * sheet.triangle_stiffening) * law.invariant;
  for (int i = 0; i < 3; ++i) {
    law.first[i] = alpha[i] + law.f1 * law.slope[i];
  }
  // Where the law goes on as its tangent, only what is not negative of f' d2 det C.
  const auto crushed = determinant < least;
  law.f2 = Select(crushed, zero, two * inverse * inverse * inverse);
  const F curve = law.f1 * law.half_g;
  law.curve = Select(crushed, zero, curve);
  law.curve_own = Select(crushed, zero - two * curve, zero - curve);
  return law;
}

/// Pairs of edges of a triangle, in the order of SheetMatrix::coupling.
constexpr int kPairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};

template <class F>
struct TriangleDerivatives {
  F tension[3];   ///< t_i
  F along[3];     ///< 4 H_ii
  F coupling[3];  ///< 4 H_ij by pair.
};
template <class F>
FULCRUM_INLINE TriangleDerivatives<F> LineariseTriangle(const Sheet& sheet, int half, std::size_t node,
                                                        const V<F> edge[3]) {
  const TriangleLaw<F> law = LawOf<F>(sheet, half, node, edge);
  const F four = F::All(4.0f) * law.scale, bend = F::All(2.0f * sheet.triangle_stiffening);
  const auto second = [&](int i, int j, F curve) FULCRUM_INLINE_LAMBDA {
    return F(four *
             (law.weight * (law.f2 * (law.slope[i] * law.slope[j]) + curve) + bend * (law.first[i] * law.first[j])));
  };
  TriangleDerivatives<F> out;
  for (int i = 0; i < 3; ++i) {
    out.tension[i] = F::All(2.0f) * law.scale * law.weight * law.first[i];
    out.along[i] = second(i, i, law.curve_own);
    out.coupling[i] = second(kPairs[i][0], kPairs[i][1], law.curve);
  }
  return out;
}
template <class F>
FULCRUM_INLINE F TriangleEnergy(const Sheet& sheet, int half, std::size_t node, const V<F> edge[3]) {
  const TriangleLaw<F> law = LawOf<F>(sheet, half, node, edge);
  return law.scale * (law.invariant + F::All(sheet.triangle_stiffening) * (law.invariant * law.invariant));
}

/// Per edge of a cell's triangles, what the coupling adds to its factor of d: sum over the other edges 4 H_ij d_j .
/// dp_j. Index 0 to 4: R, B, D, B', R'.
template <class F>
struct CellCoupling {
  F of[5];
};
template <class F>
FULCRUM_INLINE CellCoupling<F> CoupleCell(const float* const coupling[2][3], std::size_t node, F right, F down,
                                          F diagonal, F far_down, F far_right) {
  const auto k = [&](int half, int pair) FULCRUM_INLINE_LAMBDA { return F::Load(coupling[half][pair] + node); };
  const F up01 = k(0, 0), up02 = k(0, 1), up12 = k(0, 2), low01 = k(1, 0), low02 = k(1, 1), low12 = k(1, 2);
  return {{up01 * far_down + up02 * diagonal, low01 * far_right + low12 * diagonal,
           (up02 * right + up12 * far_down) + (low02 * far_right + low12 * down), up01 * right + up12 * diagonal,
           low01 * down + low02 * diagonal}};
}
/// dp . K dp of the coupling.
template <class F>
FULCRUM_INLINE F CurvatureOfCell(const float* const coupling[2][3], std::size_t node, const CellEdges<F>& d,
                                 const CellEdges<F>& dp) {
  F sum = F::All(0);
  for (int half = 0; half < 2; ++half) {
    F g[3];
    for (int i = 0; i < 3; ++i) {
      g[i] = Dot(d.of[half][i], dp.of[half][i]);
    }
    for (int i = 0; i < 3; ++i) {
      sum = sum + F::Load(coupling[half][i] + node) * (g[kPairs[i][0]] * g[kPairs[i][1]]);
    }
  }
  return F::All(2.0f) * sum;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
