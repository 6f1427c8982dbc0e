// Eight floats, on AVX in one register and on the baseline in two. Included only by kernels_impl.h, inside the
// namespace of one instruction set, so that no copy of it leaks into another.
#pragma once

#include <immintrin.h>

#include <cstdint>

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

#if defined(__AVX__)

struct F8 {
  __m256 v;
  static F8 Load(const float* p) { return {_mm256_load_ps(p)}; }
  static F8 All(float s) { return {_mm256_set1_ps(s)}; }
  static F8 Halves(__m128 lo, __m128 hi) { return {_mm256_set_m128(hi, lo)}; }
  void Store(float* p) const { _mm256_store_ps(p, v); }
  [[nodiscard]] __m128 lo() const { return _mm256_castps256_ps128(v); }
  [[nodiscard]] __m128 hi() const { return _mm256_extractf128_ps(v, 1); }
};
inline F8 operator+(F8 a, F8 b) { return {_mm256_add_ps(a.v, b.v)}; }
inline F8 operator-(F8 a, F8 b) { return {_mm256_sub_ps(a.v, b.v)}; }
inline F8 operator*(F8 a, F8 b) { return {_mm256_mul_ps(a.v, b.v)}; }
inline F8 operator/(F8 a, F8 b) { return {_mm256_div_ps(a.v, b.v)}; }
inline F8 operator&(F8 a, F8 b) { return {_mm256_and_ps(a.v, b.v)}; }
inline F8 operator^(F8 a, F8 b) { return {_mm256_xor_ps(a.v, b.v)}; }
inline F8 operator>(F8 a, F8 b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_GT_OQ)}; }
inline F8 operator<(F8 a, F8 b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)}; }
inline F8 Sqrt(F8 a) { return {_mm256_sqrt_ps(a.v)}; }
inline F8 Max(F8 a, F8 b) { return {_mm256_max_ps(a.v, b.v)}; }
inline F8 Min(F8 a, F8 b) { return {_mm256_min_ps(a.v, b.v)}; }
inline F8 Select(F8 mask, F8 yes, F8 no) { return {_mm256_blendv_ps(no.v, yes.v, mask.v)}; }
inline std::uint32_t Bits(F8 mask) { return static_cast<std::uint32_t>(_mm256_movemask_ps(mask.v)); }

#else

struct F8 {
  __m128 l, h;
  static F8 Load(const float* p) { return {_mm_load_ps(p), _mm_load_ps(p + 4)}; }
  static F8 All(float s) { return {_mm_set1_ps(s), _mm_set1_ps(s)}; }
  static F8 Halves(__m128 lo, __m128 hi) { return {lo, hi}; }
  void Store(float* p) const {
    _mm_store_ps(p, l);
    _mm_store_ps(p + 4, h);
  }
  [[nodiscard]] __m128 lo() const { return l; }
  [[nodiscard]] __m128 hi() const { return h; }
};
inline F8 operator+(F8 a, F8 b) { return {_mm_add_ps(a.l, b.l), _mm_add_ps(a.h, b.h)}; }
inline F8 operator-(F8 a, F8 b) { return {_mm_sub_ps(a.l, b.l), _mm_sub_ps(a.h, b.h)}; }
inline F8 operator*(F8 a, F8 b) { return {_mm_mul_ps(a.l, b.l), _mm_mul_ps(a.h, b.h)}; }
inline F8 operator/(F8 a, F8 b) { return {_mm_div_ps(a.l, b.l), _mm_div_ps(a.h, b.h)}; }
inline F8 operator&(F8 a, F8 b) { return {_mm_and_ps(a.l, b.l), _mm_and_ps(a.h, b.h)}; }
inline F8 operator^(F8 a, F8 b) { return {_mm_xor_ps(a.l, b.l), _mm_xor_ps(a.h, b.h)}; }
inline F8 operator>(F8 a, F8 b) { return {_mm_cmpgt_ps(a.l, b.l), _mm_cmpgt_ps(a.h, b.h)}; }
inline F8 operator<(F8 a, F8 b) { return {_mm_cmplt_ps(a.l, b.l), _mm_cmplt_ps(a.h, b.h)}; }
inline F8 Sqrt(F8 a) { return {_mm_sqrt_ps(a.l), _mm_sqrt_ps(a.h)}; }
inline F8 Max(F8 a, F8 b) { return {_mm_max_ps(a.l, b.l), _mm_max_ps(a.h, b.h)}; }
inline F8 Min(F8 a, F8 b) { return {_mm_min_ps(a.l, b.l), _mm_min_ps(a.h, b.h)}; }
inline F8 Select(F8 mask, F8 yes, F8 no) {
  return {_mm_blendv_ps(no.l, yes.l, mask.l), _mm_blendv_ps(no.h, yes.h, mask.h)};
}
inline std::uint32_t Bits(F8 mask) {
  return static_cast<std::uint32_t>(_mm_movemask_ps(mask.l) | (_mm_movemask_ps(mask.h) << 4));
}

#endif

inline F8 Abs(F8 a) {
  return a & F8::Halves(_mm_castsi128_ps(_mm_set1_epi32(0x7fffffff)), _mm_castsi128_ps(_mm_set1_epi32(0x7fffffff)));
}
inline F8 SignOf(F8 a) { return a & F8::All(-0.0f); }

/// Lane i of the result is lane i + 1; the last lane is lane 0.
inline F8 RotateDown(F8 a) {
  const __m128 lo = a.lo(), hi = a.hi();
  const __m128i l = _mm_castps_si128(lo), h = _mm_castps_si128(hi);
  return F8::Halves(_mm_castsi128_ps(_mm_alignr_epi8(h, l, 4)), _mm_castsi128_ps(_mm_alignr_epi8(l, h, 4)));
}
/// The inverse of RotateDown.
inline F8 RotateUp(F8 a) {
  const __m128i l = _mm_castps_si128(a.lo()), h = _mm_castps_si128(a.hi());
  return F8::Halves(_mm_castsi128_ps(_mm_alignr_epi8(l, h, 12)), _mm_castsi128_ps(_mm_alignr_epi8(h, l, 12)));
}

struct V8 {
  F8 x, y, z;
};
inline V8 operator+(V8 a, V8 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline V8 operator-(V8 a, V8 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline V8 operator*(V8 a, F8 s) { return {a.x * s, a.y * s, a.z * s}; }
inline F8 Dot(V8 a, V8 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V8 Cross(V8 a, V8 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

/// Eight xyzw particles, transposed into lanes.
struct Particles8 {
  V8 p;
  F8 w;
};
inline Particles8 GatherXyzw(const float* particles, const std::uint32_t* index) {
  __m128 r[8];
  for (int i = 0; i < 8; ++i) {
    r[i] = _mm_load_ps(particles + 4 * static_cast<std::size_t>(index[i]));
  }
  _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
  _MM_TRANSPOSE4_PS(r[4], r[5], r[6], r[7]);
  return {{F8::Halves(r[0], r[4]), F8::Halves(r[1], r[5]), F8::Halves(r[2], r[6])}, F8::Halves(r[3], r[7])};
}
inline void ScatterXyzw(const Particles8& q, float* particles, const std::uint32_t* index) {
  __m128 r[8] = {q.p.x.lo(), q.p.y.lo(), q.p.z.lo(), q.w.lo(), q.p.x.hi(), q.p.y.hi(), q.p.z.hi(), q.w.hi()};
  _MM_TRANSPOSE4_PS(r[0], r[1], r[2], r[3]);
  _MM_TRANSPOSE4_PS(r[4], r[5], r[6], r[7]);
  for (int i = 0; i < 8; ++i) {
    _mm_store_ps(particles + 4 * static_cast<std::size_t>(index[i]), r[i]);
  }
}

/// Eight particles anywhere in the pool.
inline Particles8 GatherPool(const float* pool, const std::uint32_t* base, const std::uint32_t* step) {
  alignas(32) float x[8], y[8], z[8], w[8];
  for (int i = 0; i < 8; ++i) {
    const float* at = pool + base[i];
    const std::size_t s = step[i];
    x[i] = at[0];
    y[i] = at[s];
    z[i] = at[2 * s];
    w[i] = at[3 * s];
  }
  return {{F8::Load(x), F8::Load(y), F8::Load(z)}, F8::Load(w)};
}
inline void ScatterPool(const V8& p, float* pool, const std::uint32_t* base, const std::uint32_t* step) {
  alignas(32) float x[8], y[8], z[8];
  p.x.Store(x);
  p.y.Store(y);
  p.z.Store(z);
  for (int i = 0; i < 8; ++i) {
    float* at = pool + base[i];
    const std::size_t s = step[i];
    at[0] = x[i];
    at[s] = y[i];
    at[2 * s] = z[i];
  }
}

/// atan of t in [0, 1], |error| < 3e-7 rad: reduced to |u| <= tan(pi/8) by (t - 1)/(t + 1), then an odd polynomial.
inline F8 AtanUnit(F8 t) {
  const F8 one = F8::All(1.0f);
  const F8 big = t > F8::All(0.41421356f);
  const F8 u = Select(big, (t - one) / (t + one), t);
  const F8 s = u * u;
  const F8 poly =
      ((F8::All(0.0805374449f) * s - F8::All(0.138776856f)) * s + F8::All(0.199777106f)) * s - F8::All(0.333329491f);
  return Select(big, F8::All(0.78539816f), F8::All(0.0f)) + (u + u * s * poly);
}
/// Angle of (cosine, sine) scaled by any positive factor, in (-pi, pi].
inline F8 Atan2(F8 sine, F8 cosine) {
  const F8 as = Abs(sine), ac = Abs(cosine);
  const F8 steep = as > ac;
  const F8 ratio = Min(as, ac) / Max(Max(as, ac), F8::All(1e-37f));
  F8 a = AtanUnit(ratio);
  a = Select(steep, F8::All(1.57079633f) - a, a);
  a = Select(cosine < F8::All(0.0f), F8::All(3.14159265f) - a, a);
  return a ^ SignOf(sine);
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
