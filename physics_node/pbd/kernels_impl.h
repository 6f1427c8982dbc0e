// Bodies of the kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set. Constraint kernels all
// go: load, constraint value, gradient, masses, lambda, apply.
#pragma once

#include "physics_node/pbd/grid_sweep.h"
#include "physics_node/pbd/touch_impl.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// With vertices that cannot move, the others must not make up for all of it however small their part in the constraint
/// is: this part of the largest possible sum of w |gradient|^2 is divided by at least. A constraint between free
/// vertices of like mass is above it.
template <class F>
inline F LeastSum(F largest_w, F largest_gradient_sq) {
  return F::All(0.2f) * (largest_w * largest_gradient_sq);
}

/// Distance constraint |q - p| = rest.
template <class F>
inline V<F> StretchImpulse(const Pair<F>& s, const V<F>& d, F rest, F k) {
  const F length = Sqrt(Dot(d, d));
  const F factor = k * (length - rest) / Max(length * (s.w_p + s.w_q), Tiny<F>());
  return d * (factor & (rest > F::All(0.0f)));
}

struct PbdStretch {
  const float* rest[3];
  float k;
  template <class F>
  [[nodiscard]] V<F> Impulse(const Pair<F>& s, const V<F>& d, int direction, std::size_t at, std::size_t next) const {
    return StretchImpulse(s, d, Batches<F>::Load(rest[direction] + at, next), F::All(k));
  }
};

void GridStretch(const GridArrays& g, float stiffness) {
  SweepGrid(g, PbdStretch{{g.rest[0], g.rest[1], g.rest[2]}, stiffness});
}

template <class F>
FULCRUM_INLINE void ProjectSprings(float* particles, const SpringBatch& batch, float stiffness) {
  constexpr std::size_t kStep = kNext<SpringBatch>;
  const Particles<F> a = GatherXyzw<F>(particles, batch.a, kStep);
  const Particles<F> b = GatherXyzw<F>(particles, batch.b, kStep);
  Pair<F> s{a.p, b.p, a.w, b.w};
  s.Move(StretchImpulse(s, s.q - s.p, Batches<F>::Load(batch.rest, kStep), F::All(stiffness)));
  ScatterXyzw<F>({s.p, s.w_p}, particles, batch.a, kStep);
  ScatterXyzw<F>({s.q, s.w_q}, particles, batch.b, kStep);
}

template <class F>
FULCRUM_INLINE void ProjectVolumes(float* particles, const TetBatch& batch, float stiffness) {
  constexpr std::size_t kStep = kNext<TetBatch>;
  Particles<F> q[4];
  for (int j = 0; j < 4; ++j) {
    q[j] = GatherXyzw<F>(particles, batch.v[j], kStep);
  }
  // Six times the volume and its gradients; the first vertex's is minus the sum of the others'.
  const V<F> b = q[1].p - q[0].p, c = q[2].p - q[0].p, d = q[3].p - q[0].p;
  const V<F> gd = Cross(b, c), gb = Cross(c, d), gc = Cross(d, b);
  const V<F> ga = gb + gc + gd;
  const F sum = q[0].w * Dot(ga, ga) + q[1].w * Dot(gb, gb) + q[2].w * Dot(gc, gc) + q[3].w * Dot(gd, gd);
  const F lambda = F::All(stiffness) * (Batches<F>::Load(batch.rest_volume, kStep) - Dot(gd, d)) /
                   Max(sum, Batches<F>::Load(batch.floor, kStep));
  q[0].p = q[0].p - ga * (lambda * q[0].w);
  q[1].p = q[1].p + gb * (lambda * q[1].w);
  q[2].p = q[2].p + gc * (lambda * q[2].w);
  q[3].p = q[3].p + gd * (lambda * q[3].w);
  for (int j = 0; j < 4; ++j) {
    ScatterXyzw<F>(q[j], particles, batch.v[j], kStep);
  }
}

template <class F>
FULCRUM_INLINE void ProjectBending(float* particles, const BendingBatch& batch, float stiffness) {
  constexpr std::size_t kStep = kNext<BendingBatch>;
  const F pi = F::All(3.14159265f), two_pi = F::All(6.28318531f), zero = F::All(0.0f);
  Particles<F> q[4];
  for (int j = 0; j < 4; ++j) {
    q[j] = GatherXyzw<F>(particles, batch.v[j], kStep);
  }
  const F floor = Batches<F>::Load(batch.floor, kStep);
  const V<F> e = q[1].p - q[0].p;
  const F length = Max(Sqrt(Dot(e, e)), Tiny<F>());
  const V<F> n1 = Cross(q[0].p - q[2].p, q[1].p - q[2].p);
  const V<F> n2 = Cross(q[1].p - q[3].p, q[0].p - q[3].p);
  const V<F> hinge = e * (F::All(1.0f) / length);
  const F angle = Atan2(Dot(Cross(n1, n2), hinge), Dot(n1, n2));
  const V<F> m1 = n1 * (F::All(1.0f) / Max(Dot(n1, n1), floor));
  const V<F> m2 = n2 * (F::All(1.0f) / Max(Dot(n2, n2), floor));
  const V<F> g2 = m1 * (zero - length);
  const V<F> g3 = m2 * (zero - length);
  const V<F> g0 = m1 * Dot(q[1].p - q[2].p, hinge) + m2 * Dot(q[1].p - q[3].p, hinge);
  const V<F> g1 = m1 * Dot(q[2].p - q[0].p, hinge) + m2 * Dot(q[3].p - q[0].p, hinge);
  const F sum = q[0].w * Dot(g0, g0) + q[1].w * Dot(g1, g1) + q[2].w * Dot(g2, g2) + q[3].w * Dot(g3, g3);
  const F w_max = Max(Max(q[0].w, q[1].w), Max(q[2].w, q[3].w));
  const F g_max = Max(Max(Dot(g0, g0), Dot(g1, g1)), Max(Dot(g2, g2), Dot(g3, g3)));
  F c = angle - Batches<F>::Load(batch.rest_angle, kStep);
  c = Select(c > pi, c - two_pi, c);
  c = Select(c < zero - pi, c + two_pi, c);
  const F lambda = (F::All(-stiffness) * Batches<F>::Load(batch.active, kStep)) * c /
                   Max(Max(sum, LeastSum(w_max, g_max)), Tiny<F>());
  const V<F> g[4] = {g0, g1, g2, g3};
  for (int j = 0; j < 4; ++j) {
    q[j].p = q[j].p + g[j] * (lambda * q[j].w);
    ScatterXyzw<F>(q[j], particles, batch.v[j], kStep);
  }
}

template <class F>
FULCRUM_INLINE void ProjectBindings(float* pool, const BindingBatch& batch, const BindingStiffness& stiffness) {
  constexpr std::size_t kStep = kNext<BindingBatch>;
  const F zero = F::All(0.0f);
  const Particles<F> node = GatherPool<F>(pool, batch.base[0], batch.step[0], kStep);
  Particles<F> q[3];
  F b[3];
  for (int j = 0; j < 3; ++j) {
    q[j] = GatherXyzw<F>(pool, batch.base[j + 1], kStep);
    b[j] = Batches<F>::Load(batch.barycentric[j], kStep);
  }
  const V<F> d = node.p - (q[0].p * b[0] + q[1].p * b[1] + q[2].p * b[2]);
  const F length = Sqrt(Dot(d, d));
  const V<F> area = Cross(q[1].p - q[0].p, q[2].p - q[0].p);
  const V<F> n = area * (F::All(1.0f) / Max(Sqrt(Dot(area, area)), Tiny<F>()));
  const F height = Dot(n, d), rest_height = Batches<F>::Load(batch.rest_height, kStep);
  const F drawn = Max(length - Batches<F>::Load(batch.rest_length, kStep), zero) * F::All(-stiffness.tension);
  const F pressed =
      Max(F::All(stiffness.compression) * (rest_height - height), F::All(stiffness.floor) * rest_height - height);
  const F sum = node.w + q[0].w * b[0] * b[0] + q[1].w * b[1] * b[1] + q[2].w * b[2] * b[2];
  const F w_max = Max(Max(node.w, q[0].w), Max(q[1].w, q[2].w));
  // 1 over the length and over the sum in one division.
  const F some_length = Max(length, Tiny<F>());
  const F inverse = Batches<F>::Load(batch.active, kStep) /
                    (some_length * Max(Max(sum, LeastSum(w_max, F::All(1.0f))), F::All(1e-6f)));
  const V<F> move = d * (inverse * drawn) + n * (inverse * some_length * Max(pressed, zero));
  ScatterPool<F>(node.p + move * node.w, pool, batch.base[0], batch.step[0], kStep);
  for (int j = 0; j < 3; ++j) {
    q[j].p = q[j].p - move * (q[j].w * b[j]);
    ScatterXyzw<F>(q[j], pool, batch.base[j + 1], kStep);
  }
}

void Springs(float* particles, const SpringBatch* batches, std::size_t count, float stiffness) {
  ForBatches(
      count, [&](auto lanes, std::size_t i)
                 __attribute__((always_inline)) { ProjectSprings<decltype(lanes)>(particles, batches[i], stiffness); });
}
void Volumes(float* particles, const TetBatch* batches, std::size_t count, float stiffness) {
  ForBatches(
      count, [&](auto lanes, std::size_t i)
                 __attribute__((always_inline)) { ProjectVolumes<decltype(lanes)>(particles, batches[i], stiffness); });
}
void Bending(float* particles, const BendingBatch* batches, std::size_t count, float stiffness) {
  ForBatches(
      count, [&](auto lanes, std::size_t i)
                 __attribute__((always_inline)) { ProjectBending<decltype(lanes)>(particles, batches[i], stiffness); });
}
void Bindings(float* pool, const BindingBatch* batches, std::size_t count, const BindingStiffness& stiffness) {
  ForBatches(
      count, [&](auto lanes, std::size_t i)
                 __attribute__((always_inline)) { ProjectBindings<decltype(lanes)>(pool, batches[i], stiffness); });
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

inline float LargestLane(F8 v) {
  alignas(32) float lanes[8];
  v.Store(lanes);
  float largest = lanes[0];
  for (const float lane : lanes) {
    largest = lane > largest ? lane : largest;
  }
  return largest;
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
  result.max_step_sq = LargestLane(largest);
  return result;
}

/// Lanes x, y, z of two xyzw particles.
inline F8 XyzLanes() {
  alignas(32) static constexpr float kXyz[8] = {1, 1, 1, 0, 1, 1, 1, 0};
  return F8::Load(kXyz) > F8::All(0.0f);
}

std::uint32_t IntegrateXyzw(float* now, float* previous, std::size_t count, const IntegrateSettings& settings) {
  std::uint32_t resets = 0;
  const float* g = settings.gravity;
  alignas(32) const float falls[8] = {g[0], g[1], g[2], 0, g[0], g[1], g[2], 0};
  const F8 keep = F8::All(settings.keep), limit = F8::All(settings.limit), fall = F8::Load(falls), xyz = XyzLanes();
  for (std::size_t i = 0; i < count; i += 8) {
    const F8 last = F8::Load(previous + i), x = F8::Load(now + i);
    F8 here = x;
    const F8 good = Abs(here - last) < limit;  // False for a NaN.
    if ((~Bits(good) & 0x77u) != 0) {
      here = Select(good, here, last);
      resets += static_cast<std::uint32_t>(__builtin_popcount(~Bits(good) & 0x77u));
    }
    const F8 step = (here - last) * keep + fall;
    Select(xyz, here, last).Store(previous + i);
    Select(xyz, here + (step & (Spread<3>(x) > F8::All(0.0f))), x).Store(now + i);
  }
  return resets;
}

FinishResult FinishXyzw(float* now, const float* previous, std::size_t count, float limit_sq) {
  FinishResult result{0, 0};
  const F8 limit = F8::All(limit_sq), xyz = XyzLanes();
  F8 largest = F8::All(0.0f);
  for (std::size_t i = 0; i < count; i += 8) {
    const F8 x = F8::Load(now + i), p = F8::Load(previous + i);
    const F8 d = x - p, squares = d * d;
    const F8 moved = Spread<0>(squares) + Spread<1>(squares) + Spread<2>(squares);
    const F8 good = moved < limit;  // False for a NaN.
    if (Bits(good) != 0xffu) {
      const F8 finite = moved < F8::All(3e38f);
      const F8 part = Sqrt(limit / Max(moved, limit)) & finite;
      const F8 kept = p + (d & finite) * part;
      Select(xyz, Select(good, x, kept), x).Store(now + i);
      const F8 free = Spread<3>(x) > F8::All(0.0f);
      result.resets += static_cast<std::uint32_t>(__builtin_popcount(~Bits(good) & Bits(free) & 0x11u));
    }
    largest = Max(moved & good, largest);
  }
  result.max_step_sq = LargestLane(largest);
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

const Kernels& Table(const char* name) {
  static const Kernels kernels{
      name,       GridStretch,        Springs,    Volumes, Bending, Bindings, Integrate, Finish, IntegrateXyzw,
      FinishXyzw, ComputeBlockBounds, FirstTouch, Feet};
  return kernels;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
