// Bodies of the organ's kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set: a vertex or a
// column of a 3 x 3 matrix is one register xyz_.
//
// The law at a patch: stable neo-Hookean (energy/tet_energy.h) less the part of mu that the edges carry. Its
// derivative,
//   dP = (1 - a) mu dF + lambda (cof F : dF) cof F + p d(cof F)[dF],   p = lambda (J - 1) - mu,
// together with the edges is positive semi-definite while |p| <= mu / sigma_max(F), so p is held there; the force stays
// exact.
#pragma once

#include <immintrin.h>

#include "physics_node/accurate/kernels.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using accurate::Organ;
using accurate::OrganMatrix;

struct F4 {
  __m128 v;
  static F4 Load(const float* p) { return {_mm_load_ps(p)}; }
  static F4 All(float s) { return {_mm_set1_ps(s)}; }
  void Store(float* p) const { _mm_store_ps(p, v); }
  [[nodiscard]] float First() const { return _mm_cvtss_f32(v); }
};
inline F4 operator+(F4 a, F4 b) { return {_mm_add_ps(a.v, b.v)}; }
inline F4 operator-(F4 a, F4 b) { return {_mm_sub_ps(a.v, b.v)}; }
inline F4 operator*(F4 a, F4 b) { return {_mm_mul_ps(a.v, b.v)}; }
template <int lane>
inline F4 SpreadLane(F4 a) {
  return {_mm_shuffle_ps(a.v, a.v, lane * 0x55)};
}
inline F4 CrossProduct(F4 a, F4 b) {
  constexpr int kYzx = _MM_SHUFFLE(3, 0, 2, 1);
  const F4 a1 = {_mm_shuffle_ps(a.v, a.v, kYzx)}, b1 = {_mm_shuffle_ps(b.v, b.v, kYzx)};
  const F4 c = a * b1 - a1 * b;
  return {_mm_shuffle_ps(c.v, c.v, kYzx)};
}
/// Of x y z, whatever the fourth lane holds.
inline float DotProduct(F4 a, F4 b) {
  const F4 p = a * b;
  return (p.First() + SpreadLane<1>(p).First()) + SpreadLane<2>(p).First();
}

struct Columns {
  F4 c0, c1, c2;
};
inline Columns LoadColumns(const float* p) { return {F4::Load(p), F4::Load(p + 4), F4::Load(p + 8)}; }
inline void StoreColumns(const Columns& m, F4 scale, float* p) {
  (m.c0 * scale).Store(p);
  (m.c1 * scale).Store(p + 4);
  (m.c2 * scale).Store(p + 8);
}
inline Columns CofactorColumns(const Columns& f) {
  return {CrossProduct(f.c1, f.c2), CrossProduct(f.c2, f.c0), CrossProduct(f.c0, f.c1)};
}
inline float DotColumns(const Columns& a, const Columns& b) {
  const F4 p = a.c0 * b.c0 + a.c1 * b.c1 + a.c2 * b.c2;
  return (p.First() + SpreadLane<1>(p).First()) + SpreadLane<2>(p).First();
}

/// sum x_j (x) g_j over the patch of vertex n.
inline Columns PatchGradient(const Organ& organ, const float* tube, std::uint32_t n) {
  Columns f = {F4::All(0), F4::All(0), F4::All(0)};
  for (std::uint32_t i = organ.start[n]; i < organ.start[n + 1]; ++i) {
    const F4 x = F4::Load(tube + 4 * static_cast<std::size_t>(organ.vertex[i]));
    const F4 g = F4::Load(organ.gradient + 4 * static_cast<std::size_t>(i));
    f.c0 = f.c0 + x * SpreadLane<0>(g);
    f.c1 = f.c1 + x * SpreadLane<1>(g);
    f.c2 = f.c2 + x * SpreadLane<2>(g);
  }
  return f;
}

inline float Larger(float a, float b) { return a > b ? a : b; }
inline float Smaller(float a, float b) { return a < b ? a : b; }

/// Upper bound of sigma_max(F)^2: Gershgorin on F^T F, tight near rest.
inline float LargestStretchSq(const Columns& f) {
  const float a01 = __builtin_fabsf(DotProduct(f.c0, f.c1)), a02 = __builtin_fabsf(DotProduct(f.c0, f.c2)),
              a12 = __builtin_fabsf(DotProduct(f.c1, f.c2));
  return Larger(Larger(DotProduct(f.c0, f.c0) + a01 + a02, DotProduct(f.c1, f.c1) + a01 + a12),
                DotProduct(f.c2, f.c2) + a02 + a12);
}
inline float Root(float v) { return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(v))); }

inline void OrganLinearise(const Organ& organ, const OrganMatrix& matrix, const float* place, std::uint32_t first,
                           std::uint32_t last) {
  for (std::uint32_t n = first; n < last; ++n) {
    const Columns f = PatchGradient(organ, place, n), cofactor = CofactorColumns(f);
    const float j = DotProduct(f.c0, cofactor.c0), volume = organ.volume[n];
    const float pressure = organ.lambda * (j - 1.0f) - organ.mu;
    const F4 shear = F4::All((1.0f - organ.variance) * organ.mu), p = F4::All(pressure);
    const Columns stress = {f.c0 * shear + cofactor.c0 * p, f.c1 * shear + cofactor.c1 * p,
                            f.c2 * shear + cofactor.c2 * p};
    const std::size_t at = 12 * static_cast<std::size_t>(n);
    StoreColumns(stress, F4::All(volume), matrix.stress + at);
    const float sigma = Root(Larger(LargestStretchSq(f), 1e-12f)), bound = organ.mu / sigma;
    // Flattened and inverted patches leave the indefinite part out altogether.
    const float fade = Smaller(Larger((j - 0.1f) * 2.5f, 0.0f), 1.0f);
    const float q = Larger(Smaller(pressure, bound), -bound) * fade;
    StoreColumns(cofactor, F4::All(Root(organ.lambda * volume)), matrix.c + at);
    StoreColumns(f, F4::All(q * volume), matrix.f + at);
    matrix.c[at + 3] = ((1.0f - organ.variance) * organ.mu + __builtin_fabsf(pressure - q) * sigma) * volume;
  }
}

inline void OrganStress(const Organ& organ, const OrganMatrix& matrix, const float* p, std::uint32_t first,
                        std::uint32_t last) {
  for (std::uint32_t n = first; n < last; ++n) {
    const std::size_t at = 12 * static_cast<std::size_t>(n);
    const Columns d = PatchGradient(organ, p, n), c = LoadColumns(matrix.c + at), f = LoadColumns(matrix.f + at);
    const F4 shear = SpreadLane<3>(c.c0), along = F4::All(DotColumns(c, d));
    // d(cof F)[dF], columns: dF1 x F2 + F1 x dF2 and so on.
    const Columns stress = {d.c0 * shear + c.c0 * along + (CrossProduct(d.c1, f.c2) + CrossProduct(f.c1, d.c2)),
                            d.c1 * shear + c.c1 * along + (CrossProduct(d.c2, f.c0) + CrossProduct(f.c2, d.c0)),
                            d.c2 * shear + c.c2 * along + (CrossProduct(d.c0, f.c1) + CrossProduct(f.c0, d.c1))};
    StoreColumns(stress, F4::All(1.0f), matrix.stress + at);
  }
}

inline void OrganGather(const Organ& organ, const OrganMatrix& matrix, const float* p, float* out, std::uint32_t first,
                        std::uint32_t last) {
  const F4 keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  for (std::uint32_t v = first; v < last; ++v) {
    const F4 here = F4::Load(p + 4 * static_cast<std::size_t>(v));
    F4 sum = F4::All(0);
    for (std::uint32_t i = organ.patch_start[v]; i < organ.patch_start[v + 1]; ++i) {
      const std::size_t n = organ.patch[i];
      const Columns stress = LoadColumns(matrix.stress + 12 * n);
      const F4 g = F4::Load(organ.patch_gradient + 4 * static_cast<std::size_t>(i));
      sum = sum + (stress.c0 * SpreadLane<0>(g) + stress.c1 * SpreadLane<1>(g) + stress.c2 * SpreadLane<2>(g) +
                   (here - F4::Load(p + 4 * n)) * SpreadLane<3>(g));
    }
    F4{_mm_and_ps(sum.v, keep.v)}.Store(out + 4 * static_cast<std::size_t>(v));
  }
}

/// Patches overlap by a dozen vertices, so their diagonal blocks alone overshoot: the largest eigenvalue of the
/// preconditioned matrix is 8. Modes of which little is excited would then grow under a truncated solve; this factor
/// brings it to 6, where they decay, and costs no accuracy.
constexpr float kOrganDamping = 0.6f;

inline void OrganBlocks(const Organ& organ, const OrganMatrix& matrix, const float* pool, const float* extra,
                        float inertia, std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t v = first; v < last; ++v) {
    const std::size_t at = 12 * static_cast<std::size_t>(v);
    if (!(pool[4 * static_cast<std::size_t>(v) + 3] > 0.0f)) {
      StoreColumns({F4::All(0), F4::All(0), F4::All(0)}, F4::All(0), matrix.block + at);
      continue;
    }
    float own = extra[v] + organ.mass[v] * inertia;
    Columns k = {F4::All(0), F4::All(0), F4::All(0)};
    for (std::uint32_t i = organ.patch_start[v]; i < organ.patch_start[v + 1]; ++i) {
      const Columns c = LoadColumns(matrix.c + 12 * static_cast<std::size_t>(organ.patch[i]));
      const F4 g = F4::Load(organ.patch_gradient + 4 * static_cast<std::size_t>(i));
      const F4 u = c.c0 * SpreadLane<0>(g) + c.c1 * SpreadLane<1>(g) + c.c2 * SpreadLane<2>(g);
      k.c0 = k.c0 + u * SpreadLane<0>(u);
      k.c1 = k.c1 + u * SpreadLane<1>(u);
      k.c2 = k.c2 + u * SpreadLane<2>(u);
      own += SpreadLane<3>(c.c0).First() * DotProduct(g, g) + SpreadLane<3>(g).First();
    }
    k.c0 = k.c0 + F4{_mm_set_ps(0, 0, 0, own)};
    k.c1 = k.c1 + F4{_mm_set_ps(0, 0, own, 0)};
    k.c2 = k.c2 + F4{_mm_set_ps(0, own, 0, 0)};
    // The inverse of a symmetric matrix is its cofactor over its determinant.
    const Columns cofactor = CofactorColumns(k);
    StoreColumns(cofactor, F4::All(kOrganDamping / DotProduct(k.c0, cofactor.c0)), matrix.block + at);
  }
}

inline double OrganEnergy(const Organ& organ, const float* place, std::uint32_t first, std::uint32_t last) {
  double sum = 0;
  for (std::uint32_t n = first; n < last; ++n) {
    const Columns f = PatchGradient(organ, place, n);
    const float j = DotProduct(f.c0, CrossProduct(f.c1, f.c2)) - 1.0f;
    const float density = 0.5f * organ.mu * (1.0f - organ.variance) * (DotColumns(f, f) - 3.0f) - organ.mu * j +
                          0.5f * organ.lambda * (j * j);
    sum += static_cast<double>(density * organ.volume[n]);
    const F4 here = F4::Load(place + 4 * static_cast<std::size_t>(n));
    float edges = 0;
    for (std::uint32_t i = organ.patch_start[n]; i < organ.patch_start[n + 1]; ++i) {
      const F4 d = here - F4::Load(place + 4 * static_cast<std::size_t>(organ.patch[i]));
      edges += organ.patch_gradient[4 * static_cast<std::size_t>(i) + 3] * DotProduct(d, d);
    }
    sum += 0.25 * static_cast<double>(edges);  // Each edge is met from both ends.
  }
  return sum;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
