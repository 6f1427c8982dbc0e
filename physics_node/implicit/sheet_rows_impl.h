// The kernels of the membrane that cost most: edges linearised, the product with their matrix, and the curvature along
// a direction. Compiled once per instruction set, after sheet_kernels_impl.h.
//
//   edge        d = x_j - x_i,  e = |d| / L - 1,  T = A (e + c e^3),  T' = A (1 + 3 c e^2) / L
//   force on i  f = T d / |d|, on j -f
//   stiffness   K = kt I + along d d^T,  kt = max(T / |d|, 0),  along = max(T' - kt, 0) / |d|^2
//   residual    r = f + load + m (g - s (x* - x_n) + v_n / h)
//   block       D = K + (k_e + m s) I, summed over the edges of the node, without the coupling of triangles
//   product     q_i = m s p_i + sum over edges K (p_i - p_j)
//   curvature   p . q = sum over nodes m s |p_i|^2 + sum over edges (p_j - p_i) . K (p_j - p_i)
//
//   x*, x_n, v_n  linearisation point [m]; position [m] and velocity [m/s] at the beginning of a substep of h [s]
//   L, A, c       rest length [m], tension per strain [N], stiffening
//   T, T'         tension [N] and its derivative [N/m]; kt [N/m], along [N/m^3]: no negative transverse stiffness, so
//                 K is never below the second derivative and a solve does not overshoot
//   m, s, g       mass [kg], (1 + damping h) / h^2 [1/s^2], gravity [m/s^2]; k_e stiffness of other elements [N/m]
//
// Stencil. Each edge is computed once, at the node that owns it, and its effect on the far end is handed on:
//
//   (r, c) ──0── (r, c+1)       0 to the right: from slot to slot in registers (Carried); from the last slot to the
//     │  ╲                        first of the next lane
//     1    2                    1 below, 2 below right: to the row below in a carry row, kEdgeTerms planes of a row
//     │      ╲                    (three for a product)
//   (r+1, c) (r+1, c+1)
//
// Model continuum adds the triangles of a cell (sheet_triangles_impl.h), at the node that owns the cell.
//
// A row is swept slot by slot, or two slots at a time in AVX-512; each lane has the same operations in the same order.
// A task of rows computes the downward edges of the row above its first one again, so that tasks share nothing.
#pragma once

#include "physics_node/implicit/sheet_kernels_impl.h"
#include "physics_node/implicit/sheet_triangles_impl.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using implicit::kEdgeTerms;
using implicit::kRowTerms;

/// Slots of a row that one register F holds.
template <class F>
struct Slots;

template <>
struct Slots<F8> {
  /// What follows slot `at`: the last slot of a row is followed by `first`, one lane on.
  static F8 After(const float* x, std::size_t at, bool wraps, std::size_t first) {
    return wraps ? RotateDown(F8::Load(x + first)) : F8::Load(x + at + kLanes);
  }
  /// Replaces what the slots before have handed on by `now`, and returns it.
  static F8 Pass(F8* kept, F8 now) {
    const F8 before = *kept;
    *kept = now;
    return before;
  }
  static void Begin(F8 last, F8* kept) { *kept = last; }
#if defined(__AVX512F__)
  static F8 Pass(F16* kept, F8 now) {
    const F8 before = kept->hi();
    *kept = F16::Halves(now, now);
    return before;
  }
  static void Begin(F8 last, F16* kept) { *kept = F16::Halves(last, last); }
#endif
};

#if defined(__AVX512F__)
template <>
struct Slots<F16> {
  static F16 After(const float* x, std::size_t at, bool wraps, std::size_t first) {
    return wraps ? F16::Halves(F8::Load(x + at + kLanes), RotateDown(F8::Load(x + first))) : F16::Load(x + at + kLanes);
  }
  static F16 Pass(F16* kept, F16 now) {
    const __m512d before = _mm512_castps_pd(kept->v);
    *kept = now;
    return {_mm512_castpd_ps(_mm512_shuffle_f64x2(before, _mm512_castps_pd(now.v), _MM_SHUFFLE(1, 0, 3, 2)))};
  }
};
#endif

template <class F>
FULCRUM_INLINE V<F> LoadSlots(const float* const plane[3], std::size_t at) {
  return {F::Load(plane[0] + at), F::Load(plane[1] + at), F::Load(plane[2] + at)};
}
template <class F>
FULCRUM_INLINE void StoreSlots(const V<F>& v, float* const plane[3], std::size_t at) {
  v.x.Store(plane[0] + at);
  v.y.Store(plane[1] + at);
  v.z.Store(plane[2] + at);
}
template <class F>
FULCRUM_INLINE V<F> LoadAfter(const float* const x[3], std::size_t at, bool wraps, std::size_t first) {
  return {Slots<F>::After(x[0], at, wraps, first), Slots<F>::After(x[1], at, wraps, first),
          Slots<F>::After(x[2], at, wraps, first)};
}

/// The other end of the edges of the slots at `s`: the node to the right, below, below right.
template <class F>
struct EndsOf {
  V<F> right, below, diagonal;
};
template <class F>
FULCRUM_INLINE EndsOf<F> LoadEndsOf(const Sheet& sheet, const float* const x[3], std::size_t start, int s,
                                    std::size_t below) {
  const std::size_t at = start + kLanes * static_cast<std::size_t>(s);
  const bool wraps = s + F::kBatches == sheet.slots;
  return {LoadAfter<F>(x, at, wraps, start), LoadSlots<F>(x, at + below),
          LoadAfter<F>(x, at + below, wraps, start + below)};
}
/// Floats from a row to the one below. The last row has no edge downwards: any finite value serves.
inline std::size_t Below(const Sheet& sheet, int row) {
  return row + 1 == sheet.rows ? 0 : kLanes * static_cast<std::size_t>(sheet.slots);
}

/// body<F>(slot) over a row, with the widest F that is left room for.
template <class Body>
FULCRUM_INLINE void ForSlots(int slots, const Body& body) {
  int s = 0;
  for (; s + Widest::kBatches <= slots; s += Widest::kBatches) {
    body.template operator()<Widest>(s);
  }
  if (Widest::kBatches > 1 && s < slots) {
    body.template operator()<F8>(s);
  }
}

/// Sums over a row, of its even slots and of its odd ones: the same with one slot or two at a time.
struct RowSum {
  F8 even = F8::All(0), odd = F8::All(0);
  FULCRUM_INLINE void Add(F8 v, int s) {
    if (s % 2 == 0) {
      even = even + v;
    } else {
      odd = odd + v;
    }
  }
#if defined(__AVX512F__)
  FULCRUM_INLINE void Add(F16 v, int) {
    even = even + v.lo();
    odd = odd + v.hi();
  }
#endif
  [[nodiscard]] double Value() const { return SumOf(even + odd); }
};

/// What an edge does to its first node: force, and the six entries xx yy zz xy xz yz of its stiffness.
template <class F>
struct EdgeTerms {
  F v[kEdgeTerms];
};
/// Adds the terms of an edge at its far end: the force with the opposite sign, the stiffness with the same.
template <class F>
FULCRUM_INLINE F AddAtFarEnd(F sum, F term, int c) {
  return c < 3 ? sum - term : sum + term;
}

/// Edges along `d`: their tension over their length, and their stiffness kt I + along d d^T.
template <class F>
struct Linear {
  V<F> d;
  F tension, kt, along;
};
template <class F>
FULCRUM_INLINE Linear<F> LineariseEdge(const V<F>& d, F inverse_rest, F axial, F stiffening) {
  const F zero = F::All(0), one = F::All(1.0f);
  const F length = Sqrt(Max(Dot(d, d), F::All(kLeastSquare_m2))), inverse = one / length;
  const F strain = length * inverse_rest - one, j = stiffening * (strain * strain);
  const F tension = axial * (strain * (one + j)) * inverse;
  const F tangent = axial * inverse_rest * (one + F::All(3.0f) * j);
  const F kt = Max(tension, zero);
  return {d, tension, kt, Max(tangent - kt, zero) * (inverse * inverse)};
}
template <class F>
FULCRUM_INLINE EdgeTerms<F> ActingOnEnds(const Linear<F>& e) {
  const V<F> f = e.d * e.tension, a = e.d * e.along;
  return {{f.x, f.y, f.z, e.kt + a.x * e.d.x, e.kt + a.y * e.d.y, e.kt + a.z * e.d.z, a.x * e.d.y, a.x * e.d.z,
           a.y * e.d.z}};
}

/// Handed on from slot to slot along a row: the terms of edges to the right and along diagonals at their far end. What
/// leaves the last slot enters the first one, one lane on.
template <int kCount>
struct Carried {
  Widest v[kCount];
  FULCRUM_INLINE void Begin(F8 last, int c) { Slots<F8>::Begin(last, &v[c]); }
  template <class F>
  FULCRUM_INLINE F Pass(F now, int c) {
    return Slots<F>::Pass(&v[c], now);
  }
};

/// Tension and `along` that an edge has of a triangle of another cell.
template <class F>
struct OtherTriangle {
  F tension, along;
};

/// One row: `above` are the terms that the row above hands down, kRowTerms planes of a row; those for the next row go
/// to `below`. With `only_below` nothing else is done but, with `stores`, the matrix of what reaches into the next row.
/// `springs`: edges can be springs; `triangles`: cells have them.
template <bool only_below, bool springs, bool triangles>
FULCRUM_INLINE void LineariseRow(const Sheet& sheet, const Inertia& inertia, const SheetFields& fields,
                                 const SheetMatrix& matrix, const float* above, float* below, bool stores, int row) {
  const std::size_t start = RowStart(sheet, row), stride = kLanes * static_cast<std::size_t>(sheet.slots),
                    down_by = Below(sheet, row);
  const auto linearise = [&]<class F>([[maybe_unused]] int d, const V<F>& vector, [[maybe_unused]] std::size_t node)
                             FULCRUM_INLINE_LAMBDA {
                               if constexpr (!springs) {
                                 return Linear<F>{vector, F::All(0), F::All(0), F::All(0)};
                               } else {
                                 return LineariseEdge<F>(vector, F::Load(sheet.inverse_rest[d] + node),
                                                         F::Load(sheet.axial[d] + node), F::All(sheet.stiffening));
                               }
                             };
  const auto add = []<class F>(Linear<F>* edge, F tension, F along) FULCRUM_INLINE_LAMBDA {
    edge->tension = edge->tension + tension;
    edge->kt = edge->kt + Max(tension, F::All(0));
    edge->along = edge->along + along;
  };
  /// Of the edge to the right, what the row above hands down.
  const auto from_above = [&]<class F>(std::size_t slot) FULCRUM_INLINE_LAMBDA {
    return OtherTriangle<F>{F::Load(above + kEdgeTerms * stride + slot),
                            F::Load(above + (kEdgeTerms + 1) * stride + slot)};
  };
  Carried<kEdgeTerms> left, diagonal;
  Carried<2> upper;
  {
    const std::size_t slot = stride - kLanes, last = start + slot;
    const V8 x = LoadV(fields.point, last);
    const EndsOf<F8> ends = LoadEndsOf<F8>(sheet, fields.point, start, sheet.slots - 1, down_by);
    Linear<F8> right = linearise(0, ends.right - x, last), across = linearise(2, ends.diagonal - x, last);
    if constexpr (triangles) {
      const CellEdges<F8> cell = EdgesOfCell<F8>(ends.right - x, ends.below - x, ends.diagonal - x);
      const TriangleDerivatives<F8> up = LineariseTriangle<F8>(sheet, 0, last, cell.of[0]),
                                    low = LineariseTriangle<F8>(sheet, 1, last, cell.of[1]);
      if constexpr (!only_below) {
        const OtherTriangle<F8> other = from_above.template operator()<F8>(slot);
        add(&right, up.tension[0] + other.tension, up.along[0] + other.along);
      }
      add(&across, up.tension[2] + low.tension[2], up.along[2] + low.along[2]);
      upper.Begin(RotateUp(up.tension[1]), 0);
      upper.Begin(RotateUp(up.along[1]), 1);
    }
    const EdgeTerms<F8> to_right = ActingOnEnds(right), to_diagonal = ActingOnEnds(across);
    for (int c = 0; c < kEdgeTerms; ++c) {
      left.Begin(RotateUp(to_right.v[c]), c);
      diagonal.Begin(RotateUp(to_diagonal.v[c]), c);
    }
  }
  ForSlots(sheet.slots, [&]<class F>(int s) FULCRUM_INLINE_LAMBDA {
    const std::size_t slot = kLanes * static_cast<std::size_t>(s), node = start + slot;
    const V<F> x = LoadSlots<F>(fields.point, node);
    const EndsOf<F> ends = LoadEndsOf<F>(sheet, fields.point, start, s, down_by);
    Linear<F> lines[3] = {linearise(1, ends.below - x, node), linearise(2, ends.diagonal - x, node),
                          only_below ? Linear<F>{} : linearise(0, ends.right - x, node)};
    if constexpr (triangles) {
      const CellEdges<F> cell = EdgesOfCell<F>(ends.right - x, ends.below - x, ends.diagonal - x);
      const TriangleDerivatives<F> up = LineariseTriangle<F>(sheet, 0, node, cell.of[0]),
                                   low = LineariseTriangle<F>(sheet, 1, node, cell.of[1]);
      add(&lines[0], low.tension[1] + upper.Pass(up.tension[1], 0), low.along[1] + upper.Pass(up.along[1], 1));
      add(&lines[1], up.tension[2] + low.tension[2], up.along[2] + low.along[2]);
      low.tension[0].Store(below + kEdgeTerms * stride + slot);
      low.along[0].Store(below + (kEdgeTerms + 1) * stride + slot);
      if constexpr (!only_below) {
        const OtherTriangle<F> other = from_above.template operator()<F>(slot);
        add(&lines[2], up.tension[0] + other.tension, up.along[0] + other.along);
      }
      if (!only_below || stores) {
        for (int i = 0; i < 3; ++i) {
          up.coupling[i].Store(matrix.coupling[0][i] + node);
          low.coupling[i].Store(matrix.coupling[1][i] + node);
        }
      }
    }
    if (!only_below || stores) {
      constexpr int kDirections[3] = {1, 2, 0};
      for (int i = 0; i < (only_below ? 2 : 3); ++i) {
        lines[i].kt.Store(matrix.kt[kDirections[i]] + node);
        lines[i].along.Store(matrix.along[kDirections[i]] + node);
      }
    }
    EdgeTerms<F> sum;
    {
      const EdgeTerms<F> down = ActingOnEnds(lines[0]), across = ActingOnEnds(lines[1]);
      for (int c = 0; c < kEdgeTerms && !only_below; ++c) {
        sum.v[c] =
            AddAtFarEnd(down.v[c], F::Load(above + static_cast<std::size_t>(c) * stride + slot), c) + across.v[c];
      }
      for (int c = 0; c < kEdgeTerms; ++c) {
        (down.v[c] + diagonal.Pass(across.v[c], c)).Store(below + static_cast<std::size_t>(c) * stride + slot);
      }
    }
    if (only_below) {
      return;
    }
    {
      const EdgeTerms<F> right = ActingOnEnds(lines[2]);
      for (int c = 0; c < kEdgeTerms; ++c) {
        sum.v[c] = AddAtFarEnd(sum.v[c], left.Pass(right.v[c], c), c) + right.v[c];
      }
    }
    const F k = F::All(inertia.inertia), zero = F::All(0);
    const auto moves = F::Load(sheet.w + node) > zero;
    const F mass = F::Load(sheet.mass + node) & moves;
    const V<F> moved = x - LoadSlots<F>(fields.start, node);
    const V<F> momentum = moved * k - LoadSlots<F>(fields.velocity, node) * F::All(1.0f / inertia.h);
    const V<F> gravity = {F::All(inertia.gravity[0]), F::All(inertia.gravity[1]), F::All(inertia.gravity[2])};
    const V<F> elastic = {sum.v[0], sum.v[1], sum.v[2]};
    StoreSlots(elastic + LoadSlots<F>(fields.load, node) + (gravity - momentum) * mass, fields.residual, node);
    const F own = F::Load(fields.element_diagonal + node) + mass * k;
    const F block[6] = {sum.v[3] + own, sum.v[4] + own, sum.v[5] + own, sum.v[6], sum.v[7], sum.v[8]};
    StoreInverseBlock<F>(block, moves, matrix.block, node);
  });
}

/// The variant that the row needs.
template <bool only_below>
inline void LineariseAnyRow(const Sheet& sheet, const Inertia& inertia, const SheetFields& fields,
                            const SheetMatrix& matrix, const float* above, float* below, bool stores, int row) {
  if (sheet.triangle[0] == nullptr) {
    LineariseRow<only_below, true, false>(sheet, inertia, fields, matrix, above, below, stores, row);
  } else if (sheet.springs_in_row[row] != 0) {
    LineariseRow<only_below, true, true>(sheet, inertia, fields, matrix, above, below, stores, row);
  } else {
    LineariseRow<only_below, false, true>(sheet, inertia, fields, matrix, above, below, stores, row);
  }
}

inline void SheetLineariseRows(const Sheet& sheet, const Inertia& inertia, const SheetFields& fields,
                               const SheetMatrix& matrix, float* memory, bool stores_above, int row0, int row1) {
  const std::size_t stride = kLanes * static_cast<std::size_t>(sheet.slots);
  float *above = memory, *below = memory + kRowTerms * stride;
  if (row0 > 0) {
    LineariseAnyRow<true>(sheet, inertia, fields, matrix, nullptr, above, stores_above, row0 - 1);
  } else {
    Clear(above, kRowTerms * stride);
  }
  for (int row = row0; row < row1; ++row) {
    LineariseAnyRow<false>(sheet, inertia, fields, matrix, above, below, true, row);
    float* const used = above;
    above = below;
    below = used;
  }
}

/// What the edges and triangles of a cell pull at the nodes to its right, below and along the diagonal: K dp. The node
/// that owns the cell gets the opposite of their sum.
template <class F>
struct CellPull {
  V<F> right, down, diagonal;
};
template <bool triangles, class F>
FULCRUM_INLINE CellPull<F> PullOfCell(const SheetMatrix& matrix, std::size_t node, const V<F>& x,
                                      const EndsOf<F>& x_ends, const V<F>& p, const EndsOf<F>& p_ends) {
  const V<F> d[3] = {x_ends.right - x, x_ends.below - x, x_ends.diagonal - x},
             dp[3] = {p_ends.right - p, p_ends.below - p, p_ends.diagonal - p};
  F g[3], factor[3];
  for (int e = 0; e < 3; ++e) {
    g[e] = Dot(d[e], dp[e]);
    factor[e] = F::Load(matrix.along[e] + node) * g[e];
  }
  const auto pull = [&](int e)
                        FULCRUM_INLINE_LAMBDA { return V<F>(dp[e] * F::Load(matrix.kt[e] + node) + d[e] * factor[e]); };
  if constexpr (!triangles) {
    return {pull(0), pull(1), pull(2)};
  } else {
    // B' begins at the node to the right, R' at the one below; both end on the diagonal.
    const V<F> far_down = d[2] - d[0], far_right = d[2] - d[1];
    const CellCoupling<F> coupled = CoupleCell<F>(matrix.coupling, node, g[0], g[1], g[2], Dot(far_down, dp[2] - dp[0]),
                                                  Dot(far_right, dp[2] - dp[1]));
    for (int e = 0; e < 3; ++e) {
      factor[e] = factor[e] + coupled.of[e];
    }
    const V<F> by_far_down = far_down * coupled.of[3], by_far_right = far_right * coupled.of[4];
    return {pull(0) - by_far_down, pull(1) - by_far_right, pull(2) + (by_far_down + by_far_right)};
  }
}

/// K p of one row's cells and its inertia into `out`, the terms for the next row into `below` [3]. Returns p . out.
template <bool only_below, bool triangles>
FULCRUM_INLINE double ApplyRow(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                               const float* above, float* below, float* const out[3], int row) {
  const std::size_t start = RowStart(sheet, row), stride = kLanes * static_cast<std::size_t>(sheet.slots),
                    down_by = Below(sheet, row);
  Carried<3> left, diagonal;
  {
    const std::size_t last = start + stride - kLanes;
    const CellPull<F8> pull = PullOfCell<triangles, F8>(
        matrix, last, LoadV(matrix.point, last), LoadEndsOf<F8>(sheet, matrix.point, start, sheet.slots - 1, down_by),
        LoadV(p, last), LoadEndsOf<F8>(sheet, p, start, sheet.slots - 1, down_by));
    const V8 to_right = UpV(pull.right), to_diagonal = UpV(pull.diagonal);
    const F8 rights[3] = {to_right.x, to_right.y, to_right.z};
    const F8 diagonals[3] = {to_diagonal.x, to_diagonal.y, to_diagonal.z};
    for (int c = 0; c < 3; ++c) {
      left.Begin(rights[c], c);
      diagonal.Begin(diagonals[c], c);
    }
  }
  const auto pass = [&]<class F>(Carried<3>* from, const V<F>& now) FULCRUM_INLINE_LAMBDA {
    return V<F>{from->Pass(now.x, 0), from->Pass(now.y, 1), from->Pass(now.z, 2)};
  };
  const float* const from[3] = {above, above + stride, above + 2 * stride};
  float* const to[3] = {below, below + stride, below + 2 * stride};
  RowSum sum;
  ForSlots(sheet.slots, [&]<class F>(int s) FULCRUM_INLINE_LAMBDA {
    const std::size_t slot = kLanes * static_cast<std::size_t>(s), node = start + slot;
    const V<F> here = LoadSlots<F>(p, node);
    const CellPull<F> pull = PullOfCell<triangles, F>(matrix, node, LoadSlots<F>(matrix.point, node),
                                                      LoadEndsOf<F>(sheet, matrix.point, start, s, down_by), here,
                                                      LoadEndsOf<F>(sheet, p, start, s, down_by));
    const V<F> incoming = only_below ? V<F>{} : LoadSlots<F>(from, slot);
    StoreSlots(pull.down + pass(&diagonal, pull.diagonal), to, slot);
    if (!only_below) {
      const F mass = (F::Load(sheet.mass + node) & (F::Load(sheet.w + node) > F::All(0))) * F::All(inertia);
      const V<F> result =
          ((pass(&left, pull.right) + incoming) - ((pull.right + pull.down) + pull.diagonal)) + here * mass;
      StoreSlots(result, out, node);
      sum.Add(Dot(here, result), s);
    }
  });
  return sum.Value();
}

template <bool triangles>
inline double ApplyRows(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                        float* const out[3], float* memory, int row0, int row1) {
  const std::size_t stride = kLanes * static_cast<std::size_t>(sheet.slots);
  float *above = memory, *below = memory + 3 * stride;
  if (row0 > 0) {
    (void)ApplyRow<true, triangles>(sheet, inertia, matrix, p, above, above, out, row0 - 1);
  } else {
    Clear(above, 3 * stride);
  }
  double sum = 0;
  for (int row = row0; row < row1; ++row) {
    sum += ApplyRow<false, triangles>(sheet, inertia, matrix, p, above, below, out, row);
    float* const used = above;
    above = below;
    below = used;
  }
  return sum;
}
inline double SheetApply(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                         float* const out[3], float* memory, int row0, int row1) {
  return sheet.triangle[0] != nullptr ? ApplyRows<true>(sheet, inertia, matrix, p, out, memory, row0, row1)
                                      : ApplyRows<false>(sheet, inertia, matrix, p, out, memory, row0, row1);
}

/// p . K p of the edges that begin in one row and of its inertia, or of those alone that lead down from it.
template <bool only_below, bool triangles>
FULCRUM_INLINE double RowCurvature(const Sheet& sheet, float inertia, const SheetMatrix& matrix,
                                   const float* const p[3], int row) {
  const std::size_t start = RowStart(sheet, row), down_by = Below(sheet, row);
  RowSum sum;
  ForSlots(sheet.slots, [&]<class F>(int s) FULCRUM_INLINE_LAMBDA {
    const std::size_t node = start + kLanes * static_cast<std::size_t>(s);
    const V<F> x = LoadSlots<F>(matrix.point, node), here = LoadSlots<F>(p, node);
    const EndsOf<F> x_ends = LoadEndsOf<F>(sheet, matrix.point, start, s, down_by),
                    p_ends = LoadEndsOf<F>(sheet, p, start, s, down_by);
    const auto edge = [&](int e, const V<F>& d, const V<F>& dp) FULCRUM_INLINE_LAMBDA {
      const F along = Dot(d, dp);
      return F(Dot(dp, dp) * F::Load(matrix.kt[e] + node) + along * along * F::Load(matrix.along[e] + node));
    };
    F of_node = edge(1, x_ends.below - x, p_ends.below - here) + edge(2, x_ends.diagonal - x, p_ends.diagonal - here);
    if constexpr (triangles) {
      of_node = of_node +
                CurvatureOfCell<F>(matrix.coupling, node,
                                   EdgesOfCell<F>(x_ends.right - x, x_ends.below - x, x_ends.diagonal - x),
                                   EdgesOfCell<F>(p_ends.right - here, p_ends.below - here, p_ends.diagonal - here));
    }
    if (!only_below) {
      const F mass = (F::Load(sheet.mass + node) & (F::Load(sheet.w + node) > F::All(0))) * F::All(inertia);
      of_node = of_node + edge(0, x_ends.right - x, p_ends.right - here) + Dot(here, here) * mass;
    }
    sum.Add(of_node, s);
  });
  return sum.Value();
}

template <bool triangles>
inline double RowsCurvature(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                            bool above, int row0, int row1) {
  double sum = above && row0 > 0 ? RowCurvature<true, triangles>(sheet, inertia, matrix, p, row0 - 1) : 0;
  for (int row = row0; row < row1; ++row) {
    sum += RowCurvature<false, triangles>(sheet, inertia, matrix, p, row);
  }
  return sum;
}
inline double SheetCurvature(const Sheet& sheet, float inertia, const SheetMatrix& matrix, const float* const p[3],
                             bool above, int row0, int row1) {
  return sheet.triangle[0] != nullptr ? RowsCurvature<true>(sheet, inertia, matrix, p, above, row0, row1)
                                      : RowsCurvature<false>(sheet, inertia, matrix, p, above, row0, row1);
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
