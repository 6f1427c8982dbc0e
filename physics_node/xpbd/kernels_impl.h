// Bodies of the XPBD kernels; compiled for each instruction set with FULCRUM_KERNEL_NAMESPACE set.
//
// Implicit step of an energy k C^2 / 2 by one linearised projection with lambda = 0 at its start (Macklin, Mueller and
// Chentanez, XPBD, 2016, eq. 18; Macklin et al., Small Steps in Physics Simulation, 2019):
//
//   x_i <- x_i - w_i g_i  s C / (1 + s S),   s = k h^2 [kg],   S = sum_j w_j |g_j|^2 [1/kg],   g_i = dC/dx_i
//
//   x_i  position [m]      w_i  inverse mass [1/kg], 0 = fixed      h  substep [s]      k  stiffness [N/m]
//
// Below, ^ marks a unit vector.
//
// Membrane edge, tension A (e + c e^3) at strain e = (|d| - L) / L; secant stiffness k = A / L (1 + c e^2)
//   C     = |d| - L [m],   d = q - p,   S = w_p + w_q
//   p += w_p i,   q -= w_q i,   impulse i = (s C d^ - h^2 T) / (1 + s S) [kg m]          T = 0 without prestrain
// Tetrahedron, stable neo-Hookean (Smith et al. 2018), as a block of two constraints (Macklin and Mueller 2021)
//   Psi   = mu/2 I + (lambda + mu)/2 (J - 1 - mu / (lambda + mu))^2 [Pa],   I = tr(F^T F),   J = det F
//   F     = E M,   E = (x_1 - x_0, x_2 - x_0, x_3 - x_0) [m],   M = E^-1 at rest [1/m]
//   d_i   = d(I/2)/dx_i = column i of F M^T,   h_i = dJ/dx_i = column i of cof(F) M^T,   i = 1..3 [1/m]
//   d_0   = -(d_1 + d_2 + d_3),   h_0 likewise
//   s_d   = mu V h^2,   s_h = (lambda + mu) V h^2 [kg m^2],   p = s_h (J - 1) - s_d
//   a     = s_d sum w d.d / I,   b = sum w d.h,   c = s_h sum w h.h
//   det   = 1 + a + c + s_d s_h (sum w d.d sum w h.h - b^2) / I
//   x_i  += w_i (u d_i + l h_i),   u = s_d (b p / I - 1 - c) / det,   l = (s_h s_d b - p (1 + a)) / det
// Hinge, quadratic bending (Bergou et al. 2006), three equal axes at once
//   C     = sum_i c_i x_i - o [m],   g_i = c_i,   S = sum_i w_i c_i^2
// Binding (eq. 9 of the paper)
//   C     = |d| - L [m],   d = x_m - sum_i b_i x_i,   g_m = d^,   g_i = -b_i d^,   S = w_m + sum_i w_i b_i^2
//
//   L              length without tension [m]                     T    tension in the rest shape, from p to q [N]
//   mu, lambda, V  Lame parameters [Pa], volume at rest [m^3]     b_i  barycentric coordinates
//   c_i, o         coefficients of a hinge, sum_i c_i x_i in the rest shape [m]
//
// Layout: batches of eight elements of one colour, no two of which share a particle (tissue/batches.h), with their
// material beside them (xpbd/kernels.h); for the edges of the membrane the stencil of tissue/grid_sweep.h.
#pragma once

#include "physics_node/tissue/grid_sweep.h"
#include "physics_node/xpbd/kernels.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Law of stretch of an edge.
///
/// `prestrained`: each edge also carries its share T of the dead load that balances the tension in the rest shape
/// (ElasticModel::load). Added to the nodes before the sweep, one sweep could not carry the load across the sheet, and
/// a membrane at rest would be blown up; edge by edge tension and load cancel exactly. A cut edge keeps its load.
template <bool prestrained>
struct XpbdStretch {
  const float* rest[3];
  xpbd::Membrane membrane;
  float h_sq;

  template <class F>
  [[nodiscard]] V<F> Impulse(const Pair<F>& s, const V<F>& d, int direction, std::size_t at, std::size_t next) const {
    const F one = F::All(1.0f), squared = F::All(h_sq);
    const F scene_rest = Batches<F>::Load(rest[direction] + at, next);
    const F unstrained = scene_rest * F::All(membrane.rest_scale);
    const F length = Sqrt(Dot(d, d)), drawn = length - unstrained;
    F k = Batches<F>::Load(membrane.stiffness[direction] + at, next) * squared;
    if (membrane.stiffening > 0.0f) {
      const F strain = drawn / Max(unstrained, Tiny<F>());
      k = k * (one + F::All(membrane.stiffening) * (strain * strain));
    }
    k = k & (scene_rest > F::All(0.0f));
    const F share = one + k * (s.w_p + s.w_q);
    if (!prestrained) {
      return d * (k * drawn / Max(length * share, Tiny<F>()));
    }
    const F inverse = one / Max(length * share, Tiny<F>());
    const F pull = k * drawn * inverse, load = squared * length * inverse;
    const float* const* tension = membrane.rest_tension[direction];
    return {d.x * pull - Batches<F>::Load(tension[0] + at, next) * load,
            d.y * pull - Batches<F>::Load(tension[1] + at, next) * load,
            d.z * pull - Batches<F>::Load(tension[2] + at, next) * load};
  }
};

void MembraneXpbd(const GridArrays& g, const xpbd::Membrane& m, float h_sq) {
  if (m.rest_tension[0][0] != nullptr) {
    SweepGrid(g, XpbdStretch<true>{{g.rest[0], g.rest[1], g.rest[2]}, m, h_sq});
  } else {
    SweepGrid(g, XpbdStretch<false>{{g.rest[0], g.rest[1], g.rest[2]}, m, h_sq});
  }
}

/// Least I = |F|^2 to divide by; 3 at rest. A tetrahedron collapsed to a point has no direction of its deviatoric
/// gradient; the bound keeps the quotient finite.
inline constexpr float kLeastSquaredF = 1e-3f;

/// The deviatoric constraint sqrt(I) and the hydrostatic one J - 1 - mu / (lambda + mu) have forces that cancel at
/// rest, so they are solved together, as a 2 x 2 block: one after the other they would shake a body at rest.
template <class F>
FULCRUM_INLINE void ProjectTets(float* particles, const TetBatch& batch, const xpbd::NeoHookeanBatch& material,
                                float h_sq) {
  constexpr std::size_t kStep = kNext<TetBatch>, kMaterial = kNext<xpbd::NeoHookeanBatch>;
  const F one = F::All(1.0f);
  Particles<F> q[4];
  for (int j = 0; j < 4; ++j) {
    q[j] = GatherXyzw<F>(particles, batch.v[j], kStep);
  }
  F m[9];
  for (int j = 0; j < 9; ++j) {
    m[j] = Batches<F>::Load(material.inverse_edges[j], kMaterial);
  }
  const V<F> e0 = q[1].p - q[0].p, e1 = q[2].p - q[0].p, e2 = q[3].p - q[0].p;
  // Columns of F = E M and of its cofactor, then the gradients as columns of F M^T and cof(F) M^T.
  V<F> f[3], cof[3], d[4], h[4];
  for (int j = 0; j < 3; ++j) {
    f[j] = e0 * m[j] + e1 * m[3 + j] + e2 * m[6 + j];
  }
  for (int j = 0; j < 3; ++j) {
    cof[j] = Cross(f[(j + 1) % 3], f[(j + 2) % 3]);
  }
  for (int i = 0; i < 3; ++i) {
    d[i + 1] = f[0] * m[3 * i] + f[1] * m[3 * i + 1] + f[2] * m[3 * i + 2];
    h[i + 1] = cof[0] * m[3 * i] + cof[1] * m[3 * i + 1] + cof[2] * m[3 * i + 2];
  }
  const F zero = F::All(0.0f);
  const V<F> none{zero, zero, zero};
  d[0] = none - (d[1] + d[2] + d[3]);
  h[0] = none - (h[1] + h[2] + h[3]);
  F dd = zero, dh = zero, hh = zero;
  for (int i = 0; i < 4; ++i) {
    dd = dd + q[i].w * Dot(d[i], d[i]);
    dh = dh + q[i].w * Dot(d[i], h[i]);
    hh = hh + q[i].w * Dot(h[i], h[i]);
  }
  const F s_d = Batches<F>::Load(material.mu, kMaterial) * F::All(h_sq);
  const F s_h = Batches<F>::Load(material.lambda, kMaterial) * F::All(h_sq);
  const F inverse_i = one / Max(Dot(f[0], f[0]) + Dot(f[1], f[1]) + Dot(f[2], f[2]), F::All(kLeastSquaredF));
  const F a = s_d * dd * inverse_i, c = s_h * hh;
  const F p = s_h * (Dot(f[0], cof[0]) - one) - s_d;
  const F det = one + a + c + (s_d * inverse_i) * (s_h * Max(dd * hh - dh * dh, zero));
  const F u = s_d * (dh * inverse_i * p - one - c) / det;
  const F l = (s_h * s_d * dh - p * (one + a)) / det;
  for (int i = 0; i < 4; ++i) {
    q[i].p = q[i].p + (d[i] * u + h[i] * l) * q[i].w;
    ScatterXyzw<F>(q[i], particles, batch.v[i], kStep);
  }
}

template <class F>
FULCRUM_INLINE void ProjectHinges(float* particles, const BendingBatch& batch, const xpbd::HingeBatch& material,
                                  float h_sq) {
  constexpr std::size_t kStep = kNext<BendingBatch>, kMaterial = kNext<xpbd::HingeBatch>;
  Particles<F> q[4];
  F c[4], sum = F::All(0.0f);
  V<F> bent{F::All(0.0f) - Batches<F>::Load(material.offset[0], kMaterial),
            F::All(0.0f) - Batches<F>::Load(material.offset[1], kMaterial),
            F::All(0.0f) - Batches<F>::Load(material.offset[2], kMaterial)};
  for (int j = 0; j < 4; ++j) {
    q[j] = GatherXyzw<F>(particles, batch.v[j], kStep);
    c[j] = Batches<F>::Load(material.c[j], kMaterial);
    bent = bent + q[j].p * c[j];
    sum = sum + q[j].w * (c[j] * c[j]);
  }
  const F s = Batches<F>::Load(material.stiffness, kMaterial) * Batches<F>::Load(batch.active, kStep) * F::All(h_sq);
  const V<F> move = bent * (s / (F::All(1.0f) + s * sum));
  for (int j = 0; j < 4; ++j) {
    q[j].p = q[j].p - move * (q[j].w * c[j]);
    ScatterXyzw<F>(q[j], particles, batch.v[j], kStep);
  }
}

template <class F>
FULCRUM_INLINE void ProjectFat(float* pool, const BindingBatch& batch, const xpbd::FatBatch& material, float h_sq) {
  constexpr std::size_t kStep = kNext<BindingBatch>, kMaterial = kNext<xpbd::FatBatch>;
  const Particles<F> node = GatherPool<F>(pool, batch.base[0], batch.step[0], kStep);
  Particles<F> q[3];
  F b[3], sum = node.w;
  V<F> d = node.p;
  for (int j = 0; j < 3; ++j) {
    q[j] = GatherXyzw<F>(pool, batch.base[j + 1], kStep);
    b[j] = Batches<F>::Load(batch.barycentric[j], kStep);
    d = d - q[j].p * b[j];
    sum = sum + q[j].w * (b[j] * b[j]);
  }
  const F length = Sqrt(Dot(d, d));
  const F s = Batches<F>::Load(material.stiffness, kMaterial) * Batches<F>::Load(batch.active, kStep) * F::All(h_sq);
  const F drawn = length - Batches<F>::Load(batch.rest_length, kStep);
  const V<F> move = d * (s * drawn / Max(length * (F::All(1.0f) + s * sum), Tiny<F>()));
  ScatterPool<F>(node.p - move * node.w, pool, batch.base[0], batch.step[0], kStep);
  for (int j = 0; j < 3; ++j) {
    q[j].p = q[j].p + move * (q[j].w * b[j]);
    ScatterXyzw<F>(q[j], pool, batch.base[j + 1], kStep);
  }
}

void TetsXpbd(float* particles, const TetBatch* tets, const xpbd::NeoHookeanBatch* material, std::size_t count,
              float h_sq) {
  ForBatches(
      count, [&](auto lanes, std::size_t i) __attribute__((always_inline)) {
        ProjectTets<decltype(lanes)>(particles, tets[i], material[i], h_sq);
      });
}
void HingesXpbd(float* particles, const BendingBatch* hinges, const xpbd::HingeBatch* material, std::size_t count,
                float h_sq) {
  ForBatches(
      count, [&](auto lanes, std::size_t i) __attribute__((always_inline)) {
        ProjectHinges<decltype(lanes)>(particles, hinges[i], material[i], h_sq);
      });
}
void BindingsXpbd(float* pool, const BindingBatch* bindings, const xpbd::FatBatch* material, std::size_t count,
                  float h_sq) {
  ForBatches(
      count, [&](auto lanes, std::size_t i)
                 __attribute__((always_inline)) { ProjectFat<decltype(lanes)>(pool, bindings[i], material[i], h_sq); });
}

constexpr xpbd::Kernels MakeKernels(const char* name) {
  return {name, MembraneXpbd, TetsXpbd, HingesXpbd, BindingsXpbd};
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
