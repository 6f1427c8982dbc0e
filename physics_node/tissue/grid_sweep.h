// One Gauss-Seidel sweep over the edges of the membrane for any law of stretch. Included only by bodies of kernels,
// inside the namespace of one instruction set.
//
//   p <- p + w_p J,   q <- q - w_q J,   J = J(d, w_p, w_q),   d = q - p
//
//   p, q      ends of an edge [m]                    w_p, w_q  inverse masses [1/kg], 0 = fixed
//   J         impulse of the law [kg m]: along d for a spring, 0 where there is no edge
//
// Stencil: the edges of node (r, c) lead to (r, c+1), (r+1, c) and (r+1, c+1): directions 0, 1 and 2.
//
// Layout: GridArrays, eight columns per vector, column c in lane c / slots and slot c % slots. The neighbour c + 1 is
// the next slot of the same lane; behind the last slot it is the first slot of the next lane (`wraps`: one rotation).
//
// Order: the even row pairs (0, 1), (2, 3), ...: direction 0 in each of the two rows (even slots, odd slots, wrap),
// then directions 1 and 2 between them (2: all but the last slot, wrap); a last row without partner: direction 0; then
// the odd row pairs (1, 2), (3, 4), ...: directions 1 and 2. The edges of each of these sets are disjoint, so their
// order within a set does not change the result.
//
// A law has
//   template <class F>
//   V<F> Impulse(const Pair<F>& s, const V<F>& d, int direction, std::size_t at, std::size_t next) const;
// for the edges of a direction at offset `at` of its planes and, with F16, `next` floats further.
#pragma once

#include "physics_node/simd/lanes.h"
#include "physics_node/tissue/batches.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// kLeastDivisor in all lanes. Numerators contain the inverse masses, so where their sum is 0 the correction is 0.
template <class F>
inline F Tiny() {
  return F::All(kLeastDivisor);
}

/// Ends of an edge per lane.
template <class F>
struct Pair {
  V<F> p, q;
  F w_p, w_q;

  void Move(const V<F>& impulse) {
    p = p + impulse * w_p;
    q = q - impulse * w_q;
  }
};

/// One row of the membrane, or with F16 two rows, `next` floats apart. `at`: offset of the first row in a plane.
template <class F>
struct GridRows {
  GridRows(const GridArrays& g, int row, int apart)
      : stride(kLanes * static_cast<std::size_t>(g.slots)),
        at(static_cast<std::size_t>(row) * stride),
        next(static_cast<std::size_t>(apart) * stride),
        x(g.x + at),
        y(g.y + at),
        z(g.z + at),
        w(g.w + at) {}
  [[nodiscard]] V<F> Load(int slot) const {
    return {Batches<F>::Load(x + kLanes * slot, next), Batches<F>::Load(y + kLanes * slot, next),
            Batches<F>::Load(z + kLanes * slot, next)};
  }
  [[nodiscard]] F LoadInverseMass(int slot) const { return Batches<F>::Load(w + kLanes * slot, next); }
  void Store(int slot, const V<F>& p) const {
    Batches<F>::Store(p.x, x + kLanes * slot, next);
    Batches<F>::Store(p.y, y + kLanes * slot, next);
    Batches<F>::Store(p.z, z + kLanes * slot, next);
  }
  [[nodiscard]] std::size_t Offset(int slot) const { return at + kLanes * static_cast<std::size_t>(slot); }

  std::size_t stride, at, next;
  float* x;
  float* y;
  float* z;
  const float* w;
};

template <class F>
inline V<F> RotateDown(const V<F>& a) {
  return {RotateDown(a.x), RotateDown(a.y), RotateDown(a.z)};
}
template <class F>
inline V<F> RotateUp(const V<F>& a) {
  return {RotateUp(a.x), RotateUp(a.y), RotateUp(a.z)};
}

/// Edges between `slot` of row a and `slot + 1` of row b. The neighbour of the last slot is the first slot of the next
/// lane (`wraps`).
template <bool wraps, class F, class Law>
FULCRUM_INLINE void StretchToNext(const GridRows<F>& a, const GridRows<F>& b, int direction, int slot, Law law) {
  const int next = wraps ? 0 : slot + 1;
  Pair<F> s{a.Load(slot), b.Load(next), a.LoadInverseMass(slot), b.LoadInverseMass(next)};
  if (wraps) {
    s.q = RotateDown(s.q);
    s.w_q = RotateDown(s.w_q);
  }
  s.Move(law.Impulse(s, s.q - s.p, direction, a.Offset(slot), a.next));
  a.Store(slot, s.p);
  b.Store(next, wraps ? RotateUp(s.q) : s.q);
}

/// Edges along a row: even slots, odd slots, then the wrap, each a set of disjoint pairs.
template <class F, class Law>
FULCRUM_INLINE void StretchAlongRow(const GridRows<F>& row, int slots, Law law) {
  for (int first = 0; first < 2; ++first) {
    for (int s = first; s + 1 < slots; s += 2) {
      StretchToNext<false>(row, row, 0, s, law);
    }
  }
  if (slots > 1) {
    StretchToNext<true>(row, row, 0, slots - 1, law);
    return;
  }
  // One slot: neighbours are lanes of one vector, so the pairs overlap. Each pair is projected by itself: those that
  // begin in even lanes, then those in odd lanes.
  for (int first = 0; first < 2; ++first) {
    for (int lane = first; lane + 1 < kLanes; lane += 2) {
      alignas(32) float lanes[kLanes] = {};
      lanes[lane] = 1.0f;
      const Pair<F> s{row.Load(0), RotateDown(row.Load(0)), row.LoadInverseMass(0), RotateDown(row.LoadInverseMass(0))};
      const V<F> all = law.Impulse(s, s.q - s.p, 0, row.Offset(0), row.next);
      const auto only = Batches<F>::Load(lanes, 0) > F::All(0.0f);
      const V<F> impulse{all.x & only, all.y & only, all.z & only};
      row.Store(0, s.p + impulse * s.w_p - RotateUp(impulse * s.w_q));
    }
  }
}

/// Edges from row a to row b: straight, then diagonal.
template <class F, class Law>
FULCRUM_INLINE void StretchBetweenRows(const GridRows<F>& a, const GridRows<F>& b, int slots, Law law) {
  for (int slot = 0; slot < slots; ++slot) {
    Pair<F> s{a.Load(slot), b.Load(slot), a.LoadInverseMass(slot), b.LoadInverseMass(slot)};
    s.Move(law.Impulse(s, s.q - s.p, 1, a.Offset(slot), a.next));
    a.Store(slot, s.p);
    b.Store(slot, s.q);
  }
  for (int slot = 0; slot + 1 < slots; ++slot) {
    StretchToNext<false>(a, b, 2, slot, law);
  }
  StretchToNext<true>(a, b, 2, slots - 1, law);
}

/// Rows `row` and row + 1, with F16 also the next two: with `along` the edges along each row while it is in the
/// first-level cache, then the edges between the two rows of a pair.
template <class F, class Law>
inline void StretchRowPairs(const GridArrays& g, int row, bool along, Law law) {
  if (along) {
    for (int r = row; r < row + 2 * F::kBatches; r += F::kBatches) {
      StretchAlongRow(GridRows<F>(g, r, 1), g.slots, law);
    }
  }
  StretchBetweenRows(GridRows<F>(g, row, 2), GridRows<F>(g, row + 1, 2), g.slots, law);
}

template <class Law>
inline void SweepGrid(const GridArrays& g, Law law) {
  // An odd row pair depends only on its two even neighbours. It follows them at once, while their rows are in the
  // cache; the result is that of all even pairs before all odd ones.
  constexpr int kRowsAtOnce = 2 * Widest::kBatches;
  int even = 0, odd = 1;
  for (; even + kRowsAtOnce <= g.rows; even += kRowsAtOnce) {
    StretchRowPairs<Widest>(g, even, true, law);
    if (odd <= even) {
      StretchRowPairs<Widest>(g, odd, false, law);
      odd += kRowsAtOnce;
    }
  }
  for (; even + 2 <= g.rows; even += 2) {
    StretchRowPairs<F8>(g, even, true, law);
  }
  if (even < g.rows) {
    StretchAlongRow(GridRows<F8>(g, even, 1), g.slots, law);
  }
  for (; odd + 2 <= g.rows; odd += 2) {
    StretchRowPairs<F8>(g, odd, false, law);
  }
}

/// Floats from an array of lanes of one batch to the same array of the next batch.
template <class Batch>
inline constexpr std::size_t kNext = sizeof(Batch) / sizeof(float);

/// Calls project(F{}, i) for the batches from i on: as many batches at a time as fit a register, then one at a time.
template <class Project>
FULCRUM_INLINE void ForBatches(std::size_t count, const Project& project) {
  std::size_t i = 0;
  for (; i + Widest::kBatches <= count; i += Widest::kBatches) {
    project(Widest{}, i);
  }
  for (; i < count; ++i) {
    project(F8{}, i);
  }
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
