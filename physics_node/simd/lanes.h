// The vector types of the kernels: F lanes of floats, F = F8 for one batch of eight, F16 for two batches at a time.
// Included only by bodies of kernels.
//
// Layouts that it loads and stores:
//   lanes    float[8], one value per constraint of a batch; the same array of the next batch is `next` floats further
//   xyzw     float[4] per particle, aligned; a gather of eight is eight 16-byte loads and a transpose
//   pool     coordinate k of a particle at pool[base + k * step] (ParticleRef): one float at a time
#pragma once

#include "physics_node/simd/instruction_set.h"
#include "physics_node/simd/limits.h"

#if defined(FULCRUM_KERNEL_SCALAR)
#include "physics_node/simd/float8_scalar.h"
#elif defined(__AVX512F__)
#include "physics_node/simd/float16.h"
#else
#include "physics_node/simd/float8.h"
#endif

/// For the bodies of innermost loops: a called function would load its constants again in each iteration.
#define FULCRUM_INLINE inline __attribute__((always_inline))
#define FULCRUM_INLINE_LAMBDA __attribute__((always_inline))

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Bits of a mask over the eight lanes of F8, as Bits() returns them: all set.
inline constexpr std::uint32_t kEveryLane = (1u << kLanes) - 1;

/// Loads and stores arrays of lanes. Those of a second batch stand `next` floats further.
template <class F>
struct Batches;

template <>
struct Batches<F8> {
  static F8 Load(const float* lanes, std::size_t) { return F8::Load(lanes); }
  static void Store(F8 v, float* lanes, std::size_t) { v.Store(lanes); }
  static F8 Gather(const float* pool, const std::uint32_t* index, const std::uint32_t* step, std::uint32_t plane,
                   std::size_t) {
    return FULCRUM_KERNEL_NAMESPACE::Gather(pool, index, step, plane);
  }
  static F8 LoadRow(const float* rows, const std::uint32_t* index, int i, std::size_t) {
    return FULCRUM_KERNEL_NAMESPACE::LoadRow(rows, index, i);
  }
  static void StoreRow(F8 row, float* rows, const std::uint32_t* index, int i, std::size_t) {
    FULCRUM_KERNEL_NAMESPACE::StoreRow(row, rows, index, i);
  }
};

#if defined(__AVX512F__) && !defined(FULCRUM_KERNEL_SCALAR)
template <>
struct Batches<F16> {
  static F16 Load(const float* lanes, std::size_t next) { return F16::Halves(F8::Load(lanes), F8::Load(lanes + next)); }
  static void Store(F16 v, float* lanes, std::size_t next) {
    v.lo().Store(lanes);
    v.hi().Store(lanes + next);
  }
  static F16 Gather(const float* pool, const std::uint32_t* index, const std::uint32_t* step, std::uint32_t plane,
                    std::size_t next) {
    return F16::Halves(FULCRUM_KERNEL_NAMESPACE::Gather(pool, index, step, plane),
                       FULCRUM_KERNEL_NAMESPACE::Gather(pool, index + next, step + next, plane));
  }
  /// Each particle goes from memory into a quarter of the register, so no shuffle is needed.
  static F16 LoadRow(const float* rows, const std::uint32_t* index, int i, std::size_t next) {
    const auto quarter = [&](std::size_t at) { return _mm_load_ps(rows + index[at]); };
    const auto first = static_cast<std::size_t>(i);
    __m512 row = _mm512_castps128_ps512(quarter(first));
    row = _mm512_mask_broadcast_f32x4(row, 0x00f0, quarter(first + 4));
    row = _mm512_mask_broadcast_f32x4(row, 0x0f00, quarter(first + next));
    return {_mm512_mask_broadcast_f32x4(row, 0xf000, quarter(first + next + 4))};
  }
  static void StoreRow(F16 row, float* rows, const std::uint32_t* index, int i, std::size_t next) {
    const auto place = [&](std::size_t at) { return rows + index[at]; };
    const auto first = static_cast<std::size_t>(i);
    _mm_store_ps(place(first), _mm512_castps512_ps128(row.v));
    _mm_store_ps(place(first + 4), _mm512_extractf32x4_ps(row.v, 1));
    _mm_store_ps(place(first + next), _mm512_extractf32x4_ps(row.v, 2));
    _mm_store_ps(place(first + next + 4), _mm512_extractf32x4_ps(row.v, 3));
  }
};
using Widest = F16;
#else
using Widest = F8;
#endif

template <class F>
struct V {
  F x, y, z;
};
using V8 = V<F8>;
template <class F>
inline V<F> operator+(V<F> a, V<F> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class F>
inline V<F> operator-(V<F> a, V<F> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class F>
inline V<F> operator*(V<F> a, F s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class F>
inline F Dot(V<F> a, V<F> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class F>
inline V<F> Cross(V<F> a, V<F> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// One particle per lane.
template <class F>
struct Particles {
  V<F> p;  ///< Position [m].
  F w;     ///< Inverse mass [1/kg], 0 = fixed.
};
/// Loads xyzw particles: that of lane i stands at rows + index[i].
template <class F>
FULCRUM_INLINE Particles<F> GatherXyzw(const float* rows, const std::uint32_t* index, std::size_t next) {
  F x = Batches<F>::LoadRow(rows, index, 0, next);
  F y = Batches<F>::LoadRow(rows, index, 1, next);
  F z = Batches<F>::LoadRow(rows, index, 2, next);
  F w = Batches<F>::LoadRow(rows, index, 3, next);
  Transpose(&x, &y, &z, &w);
  return {{x, y, z}, w};
}
template <class F>
FULCRUM_INLINE void ScatterXyzw(const Particles<F>& q, float* rows, const std::uint32_t* index, std::size_t next) {
  F r[4] = {q.p.x, q.p.y, q.p.z, q.w};
  Transpose(&r[0], &r[1], &r[2], &r[3]);
  for (int i = 0; i < 4; ++i) {
    Batches<F>::StoreRow(r[i], rows, index, i, next);
  }
}

/// Loads particles from anywhere in the pool: coordinate k of lane i at pool[base[i] + k * step[i]].
template <class F>
inline Particles<F> GatherPool(const float* pool, const std::uint32_t* base, const std::uint32_t* step,
                               std::size_t next) {
  return {{Batches<F>::Gather(pool, base, step, 0, next), Batches<F>::Gather(pool, base, step, 1, next),
           Batches<F>::Gather(pool, base, step, 2, next)},
          Batches<F>::Gather(pool, base, step, 3, next)};
}
template <class F>
inline void ScatterPool(const V<F>& p, float* pool, const std::uint32_t* base, const std::uint32_t* step,
                        std::size_t next) {
  constexpr int kCount = kLanes * F::kBatches;
  alignas(64) float x[kCount], y[kCount], z[kCount];
  Batches<F>::Store(p.x, x, kLanes);
  Batches<F>::Store(p.y, y, kLanes);
  Batches<F>::Store(p.z, z, kLanes);
  for (int batch = 0; batch < F::kBatches; ++batch, base += next, step += next) {
    for (int i = 0; i < kLanes; ++i) {
      float* at = pool + base[i];
      const std::size_t s = step[i];
      at[0] = x[kLanes * batch + i];
      at[s] = y[kLanes * batch + i];
      at[2 * s] = z[kLanes * batch + i];
    }
  }
}

/// Angle of (cosine, sine), both scaled by any positive factor, in (-pi, pi]; |error| < 3e-7 rad. With one division:
///
///   t = min(|s|, |c|) / max(|s|, |c|)                       in [0, 1]
///   atan t = pi/4 + atan u,   u = (t - 1) / (t + 1)         where t > tan(pi/8), else u = t
///   atan u = u + u^3 (((P3 u^2 - P2) u^2 + P1) u^2 - P0)    |u| <= tan(pi/8)
///   angle  = pi/2 - atan t where |s| > |c|;   pi - that where c < 0;   the sign of s
///
/// Reduction and polynomial: atanf of the Cephes library (Moshier 1992).
template <class F>
inline F Atan2(F sine, F cosine) {
  constexpr float kTanEighthPi = 0.41421356f, kQuarterPi = 0.78539816f, kHalfPi = 1.57079633f;
  constexpr float kP0 = 0.333329491f, kP1 = 0.199777106f, kP2 = 0.138776856f, kP3 = 0.0805374449f;
  constexpr float kLeastLarge = 1e-37f;  // Just above the smallest normal float: the angle of (0, 0) is 0, not NaN.
  const F as = Abs(sine), ac = Abs(cosine);
  const auto steep = as > ac;
  const F small = Min(as, ac), large = Max(Max(as, ac), F::All(kLeastLarge));
  const auto big = small > F::All(kTanEighthPi) * large;
  const F u = Select(big, small - large, small) / Select(big, small + large, large);
  const F s = u * u;
  const F poly = ((F::All(kP3) * s - F::All(kP2)) * s + F::All(kP1)) * s - F::All(kP0);
  F a = Select(big, F::All(kQuarterPi), F::All(0.0f)) + (u + u * s * poly);
  a = Select(steep, F::All(kHalfPi) - a, a);
  a = Select(cosine < F::All(0.0f), F::All(kPi) - a, a);
  return a ^ SignOf(sine);
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
