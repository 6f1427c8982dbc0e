// Bodies of the kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set. Constraint kernels all
// go: load, constraint value, gradient, masses, lambda, apply.
#pragma once

#include "physics_node/pbd/float8.h"
#include "physics_node/pbd/kernels.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Only keeps 0/0 away: numerators carry the masses, so a sum of zero masses gives a correction of zero.
inline F8 Tiny() { return F8::All(1e-30f); }

/// With vertices that cannot move, the others must not make up for all of it however small their part in the constraint
/// is: this part of the largest possible sum of w |gradient|^2 is divided by at least. A constraint between free
/// vertices of like mass is above it.
inline F8 LeastSum(F8 largest_w, F8 largest_gradient_sq) { return F8::All(0.2f) * (largest_w * largest_gradient_sq); }

struct Pair8 {
  V8 p, q;
  F8 w_p, w_q;
};

/// Distance constraint |q - p| = rest of eight pairs: dp = w_p * lambda * d, dq = -w_q * lambda * d.
inline F8 StretchFactor(const Pair8& s, V8 d, F8 rest, F8 k) {
  const F8 length = Sqrt(Dot(d, d));
  const F8 factor = k * (length - rest) / Max(length * (s.w_p + s.w_q), Tiny());
  return factor & (rest > F8::All(0.0f));
}
inline void ProjectStretch(Pair8* s, F8 rest, F8 k) {
  const V8 d = s->q - s->p;
  const F8 factor = StretchFactor(*s, d, rest, k);
  s->p = s->p + d * (factor * s->w_p);
  s->q = s->q - d * (factor * s->w_q);
}

struct GridRow {
  float* x;
  float* y;
  float* z;
  const float* w;
  [[nodiscard]] V8 Load(int slot) const {
    return {F8::Load(x + 8 * slot), F8::Load(y + 8 * slot), F8::Load(z + 8 * slot)};
  }
  [[nodiscard]] F8 LoadMass(int slot) const { return F8::Load(w + 8 * slot); }
  void Store(int slot, V8 p) const {
    p.x.Store(x + 8 * slot);
    p.y.Store(y + 8 * slot);
    p.z.Store(z + 8 * slot);
  }
};
inline GridRow RowOf(const GridArrays& g, int row) {
  const std::size_t at = static_cast<std::size_t>(row) * 8 * static_cast<std::size_t>(g.slots);
  return {g.x + at, g.y + at, g.z + at, g.w + at};
}
inline const float* RestOf(const GridArrays& g, int direction, int row) {
  return g.rest[direction] + static_cast<std::size_t>(row) * 8 * static_cast<std::size_t>(g.slots);
}
inline V8 RotateDown(V8 a) { return {RotateDown(a.x), RotateDown(a.y), RotateDown(a.z)}; }
inline V8 RotateUp(V8 a) { return {RotateUp(a.x), RotateUp(a.y), RotateUp(a.z)}; }

/// Edge between `slot` of row a and `slot + 1` of row b; the last slot's neighbour is the first one, a lane further.
inline void StretchToNext(const GridRow& a, const GridRow& b, const float* rest, int slot, int slots, F8 k) {
  const bool wraps = slot + 1 == slots;
  const int next = wraps ? 0 : slot + 1;
  Pair8 s{a.Load(slot), b.Load(next), a.LoadMass(slot), b.LoadMass(next)};
  if (wraps) {
    s.q = RotateDown(s.q);
    s.w_q = RotateDown(s.w_q);
  }
  ProjectStretch(&s, F8::Load(rest + 8 * slot), k);
  a.Store(slot, s.p);
  b.Store(next, wraps ? RotateUp(s.q) : s.q);
}

/// Edges along one row: even slots, odd slots, then the wrap, each a set of disjoint pairs.
inline void StretchAlongRow(const GridRow& row, const float* rest, int slots, F8 k) {
  for (int first = 0; first < 2; ++first) {
    for (int s = first; s + 1 < slots; s += 2) {
      StretchToNext(row, row, rest, s, slots, k);
    }
  }
  if (slots > 1) {
    StretchToNext(row, row, rest, slots - 1, slots, k);
  } else {
    // One slot: neighbours are lanes of the same vector, so the pairs overlap. Even lanes, then odd lanes.
    for (int first = 0; first < 2; ++first) {
      for (int lane = first; lane + 1 < kLanes; lane += 2) {
        const float l0 = rest[lane];
        alignas(32) float only[kLanes] = {};
        only[lane] = l0;
        Pair8 s{row.Load(0), RotateDown(row.Load(0)), row.LoadMass(0), RotateDown(row.LoadMass(0))};
        const V8 d = s.q - s.p;
        const F8 factor = StretchFactor(s, d, F8::Load(only), k);
        row.Store(0, s.p + d * (factor * s.w_p) - RotateUp(d * (factor * s.w_q)));
      }
    }
  }
}

/// Edges from row a to row b straight and diagonal.
inline void StretchBetweenRows(const GridRow& a, const GridRow& b, const float* straight, const float* diagonal,
                               int slots, F8 k) {
  for (int s = 0; s < slots; ++s) {
    Pair8 pair{a.Load(s), b.Load(s), a.LoadMass(s), b.LoadMass(s)};
    ProjectStretch(&pair, F8::Load(straight + 8 * s), k);
    a.Store(s, pair.p);
    b.Store(s, pair.q);
  }
  for (int s = 0; s < slots; ++s) {
    StretchToNext(a, b, diagonal, s, slots, k);
  }
}

void GridStretch(const GridArrays& g, float stiffness) {
  const F8 k = F8::All(stiffness);
  // Even row pairs while their rows are in the first-level cache: along both rows, then between them.
  for (int r = 0; r < g.rows; r += 2) {
    const GridRow a = RowOf(g, r);
    StretchAlongRow(a, RestOf(g, 0, r), g.slots, k);
    if (r + 1 < g.rows) {
      const GridRow b = RowOf(g, r + 1);
      StretchAlongRow(b, RestOf(g, 0, r + 1), g.slots, k);
      StretchBetweenRows(a, b, RestOf(g, 1, r), RestOf(g, 2, r), g.slots, k);
    }
  }
  for (int r = 1; r + 1 < g.rows; r += 2) {
    StretchBetweenRows(RowOf(g, r), RowOf(g, r + 1), RestOf(g, 1, r), RestOf(g, 2, r), g.slots, k);
  }
}

void Springs(float* particles, const SpringBatch* batches, std::size_t count, float stiffness) {
  const F8 k = F8::All(stiffness);
  for (std::size_t i = 0; i < count; ++i) {
    const SpringBatch& batch = batches[i];
    const Particles8 a = GatherXyzw(particles, batch.a);
    const Particles8 b = GatherXyzw(particles, batch.b);
    Pair8 s{a.p, b.p, a.w, b.w};
    ProjectStretch(&s, F8::Load(batch.rest), k);
    ScatterXyzw({s.p, s.w_p}, particles, batch.a);
    ScatterXyzw({s.q, s.w_q}, particles, batch.b);
  }
}

void Volumes(float* particles, const TetBatch* batches, std::size_t count, float stiffness) {
  const F8 k = F8::All(stiffness);
  const F8 sixth = F8::All(1.0f / 6.0f);
  for (std::size_t i = 0; i < count; ++i) {
    const TetBatch& batch = batches[i];
    Particles8 q[4];
    for (int j = 0; j < 4; ++j) {
      q[j] = GatherXyzw(particles, batch.v[j]);
    }
    const V8 b = q[1].p - q[0].p, c = q[2].p - q[0].p, d = q[3].p - q[0].p;
    const V8 gd = Cross(b, c) * sixth;
    const F8 volume = Dot(gd, d);
    const V8 gb = Cross(c, d) * sixth;
    const V8 gc = Cross(d, b) * sixth;
    const V8 ga = (gb + gc + gd) * F8::All(-1.0f);
    const F8 sum = q[0].w * Dot(ga, ga) + q[1].w * Dot(gb, gb) + q[2].w * Dot(gc, gc) + q[3].w * Dot(gd, gd);
    const F8 lambda = k * (F8::Load(batch.rest_volume) - volume) / Max(sum, F8::Load(batch.floor));
    q[0].p = q[0].p + ga * (lambda * q[0].w);
    q[1].p = q[1].p + gb * (lambda * q[1].w);
    q[2].p = q[2].p + gc * (lambda * q[2].w);
    q[3].p = q[3].p + gd * (lambda * q[3].w);
    for (int j = 0; j < 4; ++j) {
      ScatterXyzw(q[j], particles, batch.v[j]);
    }
  }
}

void Bending(float* pool, const BendingBatch* batches, std::size_t count, float stiffness) {
  const F8 pi = F8::All(3.14159265f), two_pi = F8::All(6.28318531f);
  for (std::size_t i = 0; i < count; ++i) {
    const BendingBatch& batch = batches[i];
    Particles8 q[4];
    for (int j = 0; j < 4; ++j) {
      q[j] = GatherPool(pool, batch.base[j], batch.step[j]);
    }
    const F8 floor = F8::Load(batch.floor);
    const V8 e = q[1].p - q[0].p;
    const F8 length = Max(Sqrt(Dot(e, e)), Tiny());
    const V8 n1 = Cross(q[0].p - q[2].p, q[1].p - q[2].p);
    const V8 n2 = Cross(q[1].p - q[3].p, q[0].p - q[3].p);
    const F8 angle = Atan2(Dot(Cross(n1, n2), e) / length, Dot(n1, n2));
    const V8 m1 = n1 * (F8::All(1.0f) / Max(Dot(n1, n1), floor));
    const V8 m2 = n2 * (F8::All(1.0f) / Max(Dot(n2, n2), floor));
    const V8 hinge = e * (F8::All(1.0f) / length);
    const F8 zero = F8::All(0.0f);
    const V8 g2 = m1 * (zero - length);
    const V8 g3 = m2 * (zero - length);
    const V8 g0 = m1 * Dot(q[1].p - q[2].p, hinge) + m2 * Dot(q[1].p - q[3].p, hinge);
    const V8 g1 = m1 * Dot(q[2].p - q[0].p, hinge) + m2 * Dot(q[3].p - q[0].p, hinge);
    const F8 sum = q[0].w * Dot(g0, g0) + q[1].w * Dot(g1, g1) + q[2].w * Dot(g2, g2) + q[3].w * Dot(g3, g3);
    const F8 w_max = Max(Max(q[0].w, q[1].w), Max(q[2].w, q[3].w));
    const F8 g_max = Max(Max(Dot(g0, g0), Dot(g1, g1)), Max(Dot(g2, g2), Dot(g3, g3)));
    F8 c = angle - F8::Load(batch.rest_angle);
    c = Select(c > pi, c - two_pi, c);
    c = Select(c < zero - pi, c + two_pi, c);
    const F8 lambda =
        (F8::All(-stiffness) * F8::Load(batch.active)) * c / Max(Max(sum, LeastSum(w_max, g_max)), Tiny());
    const V8 g[4] = {g0, g1, g2, g3};
    for (int j = 0; j < 4; ++j) {
      ScatterPool(q[j].p + g[j] * (lambda * q[j].w), pool, batch.base[j], batch.step[j]);
    }
  }
}

void Bindings(float* pool, const BindingBatch* batches, std::size_t count, const BindingStiffness& stiffness) {
  const F8 zero = F8::All(0.0f);
  for (std::size_t i = 0; i < count; ++i) {
    const BindingBatch& batch = batches[i];
    Particles8 q[4];
    for (int j = 0; j < 4; ++j) {
      q[j] = GatherPool(pool, batch.base[j], batch.step[j]);
    }
    const F8 b[3] = {F8::Load(batch.barycentric[0]), F8::Load(batch.barycentric[1]), F8::Load(batch.barycentric[2])};
    const V8 d = q[0].p - (q[1].p * b[0] + q[2].p * b[1] + q[3].p * b[2]);
    const F8 length = Sqrt(Dot(d, d));
    const V8 area = Cross(q[2].p - q[1].p, q[3].p - q[1].p);
    const V8 n = area * (F8::All(1.0f) / Max(Sqrt(Dot(area, area)), Tiny()));
    const F8 height = Dot(n, d), rest_height = F8::Load(batch.rest_height);
    const F8 drawn = Max(length - F8::Load(batch.rest_length), zero) * F8::All(-stiffness.tension);
    const F8 pressed =
        Max(F8::All(stiffness.compression) * (rest_height - height), F8::All(stiffness.floor) * rest_height - height);
    const F8 sum = q[0].w + q[1].w * b[0] * b[0] + q[2].w * b[1] * b[1] + q[3].w * b[2] * b[2];
    const F8 w_max = Max(Max(q[0].w, q[1].w), Max(q[2].w, q[3].w));
    const F8 scale = F8::Load(batch.active) / Max(Max(sum, LeastSum(w_max, F8::All(1.0f))), Tiny());
    const V8 move = d * (scale * drawn / Max(length, Tiny())) + n * (scale * Max(pressed, zero));
    ScatterPool(q[0].p + move * q[0].w, pool, batch.base[0], batch.step[0]);
    for (int j = 0; j < 3; ++j) {
      ScatterPool(q[j + 1].p - move * (q[j + 1].w * b[j]), pool, batch.base[j + 1], batch.step[j + 1]);
    }
  }
}

std::uint32_t Integrate(float* const now[3], float* const previous[3], const float* w, std::size_t count,
                        const IntegrateSettings& settings) {
  std::uint32_t resets = 0;
  const F8 keep = F8::All(settings.keep);
  const F8 limit = F8::All(settings.limit);
  for (int axis = 0; axis < 3; ++axis) {
    const F8 fall = F8::All(settings.gravity[axis]);
    float* x = now[axis];
    float* p = previous[axis];
    for (std::size_t i = 0; i < count; i += 8) {
      const F8 last = F8::Load(p + i);
      F8 here = F8::Load(x + i);
      const F8 good = Abs(here - last) < limit;  // False for a NaN.
      if (Bits(good) != 0xffu) {
        here = Select(good, here, last);
        resets += static_cast<std::uint32_t>(__builtin_popcount(~Bits(good) & 0xffu));
      }
      const F8 step = (here - last) * keep + fall;
      here.Store(p + i);
      (here + (step & (F8::Load(w + i) > F8::All(0.0f)))).Store(x + i);
    }
  }
  return resets;
}

FinishResult Finish(float* const now[3], const float* const previous[3], const float* w, std::size_t count,
                    float limit_sq) {
  FinishResult result{0, 0};
  F8 largest = F8::All(0.0f);
  const F8 limit = F8::All(limit_sq);
  for (std::size_t i = 0; i < count; i += 8) {
    const V8 x{F8::Load(now[0] + i), F8::Load(now[1] + i), F8::Load(now[2] + i)};
    const V8 p{F8::Load(previous[0] + i), F8::Load(previous[1] + i), F8::Load(previous[2] + i)};
    const V8 d = x - p;
    const F8 moved = Dot(d, d);
    const F8 good = moved < limit;  // False for a NaN.
    if (Bits(good) != 0xffu) {
      // Too far: only as far as allowed. Not finite: back to where it was.
      const F8 finite = moved < F8::All(3e38f);
      const F8 part = Sqrt(limit / Max(moved, limit)) & finite;
      const V8 kept = p + V8{d.x & finite, d.y & finite, d.z & finite} * part;
      Select(good, x.x, kept.x).Store(now[0] + i);
      Select(good, x.y, kept.y).Store(now[1] + i);
      Select(good, x.z, kept.z).Store(now[2] + i);
      const F8 free = F8::Load(w + i) > F8::All(0.0f);
      result.resets += static_cast<std::uint32_t>(__builtin_popcount(~Bits(good) & Bits(free) & 0xffu));
    }
    largest = Max(moved & good, largest);
  }
  alignas(32) float lanes[8];
  largest.Store(lanes);
  for (const float lane : lanes) {
    result.max_step_sq = lane > result.max_step_sq ? lane : result.max_step_sq;
  }
  return result;
}

void ComputeBlockBounds(const GridArrays& g, const BlockBounds& bounds) {
  const float* planes[3] = {g.x, g.y, g.z};
  const int cell_rows = g.rows > 1 ? g.rows - 1 : 1;
  std::size_t out = 0;
  for (int r0 = 0; r0 < cell_rows; r0 += 8) {
    const int r1 = r0 + 8 < g.rows ? r0 + 8 : g.rows - 1;
    for (int s0 = 0; s0 < g.slots; s0 += 8, out += 8) {
      const int s1 = s0 + 8 < g.slots ? s0 + 8 : g.slots;  // Inclusive when it is a slot, else the wrap.
      for (int axis = 0; axis < 3; ++axis) {
        F8 lo = F8::All(3e38f), hi = F8::All(-3e38f);
        for (int r = r0; r <= r1; ++r) {
          const float* row = planes[axis] + static_cast<std::size_t>(r) * 8 * static_cast<std::size_t>(g.slots);
          for (int s = s0; s < s1; ++s) {
            const F8 v = F8::Load(row + 8 * s);
            lo = Min(lo, v);
            hi = Max(hi, v);
          }
          const F8 edge = s1 < g.slots ? F8::Load(row + 8 * s1) : RotateDown(F8::Load(row));
          lo = Min(lo, edge);
          hi = Max(hi, edge);
        }
        lo.Store(bounds.lo[axis] + out);
        hi.Store(bounds.hi[axis] + out);
      }
    }
  }
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
