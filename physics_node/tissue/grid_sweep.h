// One Gauss-Seidel sweep over the edges of the membrane for any law of stretch. Included only by bodies of kernels,
// inside the namespace of one instruction set.
//
// A law has
//   template <class F>
//   V<F> Impulse(const Pair<F>& s, const V<F>& d, int direction, std::size_t at, std::size_t next) const;
// for the edges of a direction at offset `at` of its planes and, with F16, `next` floats further; 0 where there is no
// edge. With d = q - p, the ends then move by w_p and -w_q times it.
#pragma once

#include "physics_node/simd/lanes.h"
#include "physics_node/tissue/batches.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Only keeps 0/0 away: numerators carry the masses, so a sum of zero masses gives a correction of zero.
template <class F>
inline F Tiny() {
  return F::All(1e-30f);
}

template <class F>
struct Pair {
  V<F> p, q;
  F w_p, w_q;

  void Move(const V<F>& impulse) {
    p = p + impulse * w_p;
    q = q - impulse * w_q;
  }
};

/// One row of the membrane, or with F16 two of them, `next` floats apart. `at` is the first one's place in a plane.
template <class F>
struct GridRows {
  GridRows(const GridArrays& g, int row, int apart)
      : stride(8 * static_cast<std::size_t>(g.slots)),
        at(static_cast<std::size_t>(row) * stride),
        next(static_cast<std::size_t>(apart) * stride),
        x(g.x + at),
        y(g.y + at),
        z(g.z + at),
        w(g.w + at) {}
  [[nodiscard]] V<F> Load(int slot) const {
    return {Batches<F>::Load(x + 8 * slot, next), Batches<F>::Load(y + 8 * slot, next),
            Batches<F>::Load(z + 8 * slot, next)};
  }
  [[nodiscard]] F LoadMass(int slot) const { return Batches<F>::Load(w + 8 * slot, next); }
  void Store(int slot, const V<F>& p) const {
    Batches<F>::Store(p.x, x + 8 * slot, next);
    Batches<F>::Store(p.y, y + 8 * slot, next);
    Batches<F>::Store(p.z, z + 8 * slot, next);
  }
  [[nodiscard]] std::size_t Place(int slot) const { return at + 8 * static_cast<std::size_t>(slot); }

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

/// Edges between `slot` of row a and `slot + 1` of row b; the last slot's neighbour is the first one, a lane further
/// (`wraps`).
template <bool wraps, class F, class Law>
FULCRUM_INLINE void StretchToNext(const GridRows<F>& a, const GridRows<F>& b, int direction, int slot, Law law) {
  const int next = wraps ? 0 : slot + 1;
  Pair<F> s{a.Load(slot), b.Load(next), a.LoadMass(slot), b.LoadMass(next)};
  if (wraps) {
    s.q = RotateDown(s.q);
    s.w_q = RotateDown(s.w_q);
  }
  s.Move(law.Impulse(s, s.q - s.p, direction, a.Place(slot), a.next));
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
  // One slot: neighbours are lanes of the same vector, so the pairs overlap. Even lanes, then odd lanes.
  for (int first = 0; first < 2; ++first) {
    for (int lane = first; lane + 1 < kLanes; lane += 2) {
      alignas(32) float lanes[kLanes] = {};
      lanes[lane] = 1.0f;
      const Pair<F> s{row.Load(0), RotateDown(row.Load(0)), row.LoadMass(0), RotateDown(row.LoadMass(0))};
      const V<F> all = law.Impulse(s, s.q - s.p, 0, row.Place(0), row.next);
      const auto only = Batches<F>::Load(lanes, 0) > F::All(0.0f);
      const V<F> impulse{all.x & only, all.y & only, all.z & only};
      row.Store(0, s.p + impulse * s.w_p - RotateUp(impulse * s.w_q));
    }
  }
}

/// Edges from row a to row b straight and diagonal.
template <class F, class Law>
FULCRUM_INLINE void StretchBetweenRows(const GridRows<F>& a, const GridRows<F>& b, int slots, Law law) {
  for (int slot = 0; slot < slots; ++slot) {
    Pair<F> s{a.Load(slot), b.Load(slot), a.LoadMass(slot), b.LoadMass(slot)};
    s.Move(law.Impulse(s, s.q - s.p, 1, a.Place(slot), a.next));
    a.Store(slot, s.p);
    b.Store(slot, s.q);
  }
  for (int slot = 0; slot + 1 < slots; ++slot) {
    StretchToNext<false>(a, b, 2, slot, law);
  }
  StretchToNext<true>(a, b, 2, slots - 1, law);
}

/// Rows `row` and row + 1, and with F16 also the next two: along each while it is in the first-level cache, when
/// `along`, then between the two of a pair.
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
  // Even row pairs, then odd ones: the pairs of a set are disjoint. An odd pair needs only its two even neighbours
  // done, so it follows them at once, while their rows are in the cache.
  constexpr int kAtOnce = 2 * Widest::kBatches;
  int even = 0, odd = 1;
  for (; even + kAtOnce <= g.rows; even += kAtOnce) {
    StretchRowPairs<Widest>(g, even, true, law);
    if (odd <= even) {
      StretchRowPairs<Widest>(g, odd, false, law);
      odd += kAtOnce;
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

/// Floats from an array of one batch to that of the next.
template <class Batch>
inline constexpr std::size_t kNext = sizeof(Batch) / sizeof(float);

/// Calls project(F{}, i) for batches i, as many at a time as fit the registers, then one at a time.
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
