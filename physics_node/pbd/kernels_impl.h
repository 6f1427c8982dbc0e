// Bodies of the constraint kernels of mode paper; compiled for each instruction set with FULCRUM_KERNEL_NAMESPACE set.
//
// Projection of a constraint C(x) = 0 (Mueller et al., Position Based Dynamics, 2007):
//
//   lambda = -k C / max(S, S_min),   S = sum_j w_j |g_j|^2,   x_i <- x_i + lambda w_i g_i,   g_i = dC/dx_i
//
//   x_i  position [m]      w_i  inverse mass [1/kg], 0 = fixed      k  stiffness per iteration, in (0, 1]
//
// Below, ^ marks a unit vector.
//
// Edge (springs of the tube, grid of the membrane)
//   C     = |d| - L [m],   d = q - p
//   g_q   = d^,   g_p = -d^                                      S_min: kLeastDivisor, of |d| S
// Volume
//   C     = 6 V - 6 V0 [m^3],   6 V = (b x c) . d,   b = x_1 - x_0,   c = x_2 - x_0,   d = x_3 - x_0
//   g_1   = c x d,   g_2 = d x b,   g_3 = b x c,   g_0 = -(g_1 + g_2 + g_3)             S_min: TetBatch::floor
// Bending, the angle between triangles (x_0, x_1, x_2) and (x_1, x_0, x_3) (Bridson et al. 2003, other sign)
//   C     = theta - theta0, wrapped to [-pi, pi] [rad],   theta = atan2((n_1 x n_2) . e^, n_1 . n_2),   e = x_1 - x_0
//   n_1   = (x_0 - x_2) x (x_1 - x_2),   n_2 = (x_1 - x_3) x (x_0 - x_3)
//   m_i   = n_i / max(|n_i|^2, BendingBatch::floor)
//   g_0   = ((x_1 - x_2) . e^) m_1 + ((x_1 - x_3) . e^) m_2,   g_2 = -|e| m_1
//   g_1   = ((x_2 - x_0) . e^) m_1 + ((x_3 - x_0) . e^) m_2,   g_3 = -|e| m_2
//   S_min = kLeastShareOfSum (max_j w_j) (max_j |g_j|^2)
// Binding, tension of eq. 9 of the paper and pressure along the triangle's unit normal n^, in one correction
//   C_t   = max(|d| - L, 0) [m],   d = x_m - sum_i b_i x_i
//   C_c   = max(k_c (H - h), f H - h, 0) [m],   h = n^ . d
//   u     = (-k_t C_t d^ + C_c n^) / max(S, S_min),   S = w_m + sum_i w_i b_i^2,   x_m += w_m u,   x_i -= w_i b_i u
//   S_min = max(kLeastShareOfSum max_j w_j, kLeastBindingSum)
//
//   L, V0, theta0, H  values at rest: length [m], volume [m^3], angle [rad], height over the triangle [m]
//   b_i               barycentric coordinates           k_t, k_c, f  BindingStiffness: tension, compression, floor
//
// Layout: batches of eight constraints of one colour, no two of which share a particle (tissue/batches.h); for the
// edges of the membrane the stencil of tissue/grid_sweep.h.
#pragma once

#include "physics_node/pbd/kernels.h"
#include "physics_node/tissue/grid_sweep.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// S_min as a share of the largest possible term max w max |g|^2. If the vertex with the largest gradient is fixed or
/// held, S can become tiny and free vertices with small gradients would have to satisfy the whole constraint: the
/// correction would be blown up. Between free vertices of equal mass S is above the bound, so it does not act.
inline constexpr float kLeastShareOfSum = 0.2f;
template <class F>
inline F LeastSum(F largest_w, F largest_gradient_sq) {
  return F::All(kLeastShareOfSum) * (largest_w * largest_gradient_sq);
}

/// S_min of a binding without free particles [1/kg]: keeps the quotient finite, far below 1 / mass of any particle.
inline constexpr float kLeastBindingSum = 1e-6f;

/// Impulse of the distance constraint |q - p| = rest; 0 where rest is 0.
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
  // ga is minus the gradient of the first vertex.
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
  const F pi = F::All(kPi), two_pi = F::All(kTwoPi), zero = F::All(0.0f);
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
  // One division for 1 / |d| and 1 / S.
  const F some_length = Max(length, Tiny<F>());
  const F inverse = Batches<F>::Load(batch.active, kStep) /
                    (some_length * Max(Max(sum, LeastSum(w_max, F::All(1.0f))), F::All(kLeastBindingSum)));
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
