// Bodies of the kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set. Constraint kernels all
// go: load, constraint value, gradient, masses, lambda, apply.
#pragma once

#include "physics_node/pbd/kernels.h"
#include "physics_node/tissue/grid_sweep.h"

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
FULCRUM_INLINE void ProjectBindings(float* pool, const BindingBatch& batch, const pbd::BindingStiffness& stiffness) {
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
void Bindings(float* pool, const BindingBatch* batches, std::size_t count, const pbd::BindingStiffness& stiffness) {
  ForBatches(
      count, [&](auto lanes, std::size_t i)
                 __attribute__((always_inline)) { ProjectBindings<decltype(lanes)>(pool, batches[i], stiffness); });
}

constexpr pbd::Kernels MakeKernels(const char* name) {
  return {name, GridStretch, Springs, Volumes, Bending, Bindings};
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
