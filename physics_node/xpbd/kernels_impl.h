// Bodies of the XPBD kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set.
#pragma once

#include "physics_node/tissue/grid_sweep.h"
#include "physics_node/xpbd/kernels.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Spring with tension A (e + c e^3): linear with the secant stiffness A / L (1 + c e^2) at its present length.
///
/// `prestrained`: less the tension in the rest shape, which a dead load on its ends carries (ElasticModel::load).
/// Applied to the nodes before the sweep, the load would have to be caught by that one sweep, and a membrane at rest
/// would be blown up; spring by spring both cancel. Where an edge has been cut the load is still there.
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

/// Stable neo-Hookean (Smith et al. 2018; as constraints, Macklin and Mueller 2021):
///   Psi = mu/2 tr(F^T F) + (lambda + mu)/2 (J - 1 - mu / (lambda + mu))^2
/// is a deviatoric constraint sqrt(tr F^T F) and a hydrostatic one J - 1 - mu / (lambda + mu). At rest both pull, and
/// only together they cancel, so the two are solved as one block: one after the other would shake a body at rest.
/// With d_i, h_i the gradients of tr(F^T F) / 2 and of J, I = tr(F^T F), s_d = mu V h^2, s_h = (lambda + mu) V h^2,
/// a = s_d sum w d.d / I, b = sum w d.h, c = s_h sum w h.h, p = s_h (J - 1) - s_d:
///   u = (-s_d (1 + c) + s_d b p / I) / D,  l = (-p (1 + a) + s_h s_d b) / D,
///   D = 1 + a + c + s_d s_h (sum w d.d sum w h.h - b^2) / I,      dx_i = w_i (u d_i + l h_i).
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
  // Columns of F = D M, of its cofactor, and the gradients F M^T, cof(F) M^T.
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
  // A tet squeezed to nothing has no direction to be pulled in; this keeps the quotient finite.
  const F inverse_i = one / Max(Dot(f[0], f[0]) + Dot(f[1], f[1]) + Dot(f[2], f[2]), F::All(1e-3f));
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
