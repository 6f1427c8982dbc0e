// Sixteen floats in one AVX-512 register: two batches of eight at a time, with the operations of F8 on each lane.
#pragma once

#include <immintrin.h>

#include <cstddef>
#include <cstdint>

#include "physics_node/simd/float8.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

struct M16 {
  __mmask16 m;
};

struct F16 {
  static constexpr int kBatches = 2;
  __m512 v;
  static F16 All(float s) { return {_mm512_set1_ps(s)}; }
  /// Sixteen successive floats, aligned to 32 bytes as for F8.
  static F16 Load(const float* p) { return {_mm512_loadu_ps(p)}; }
  static F16 LoadAny(const float* p) { return Load(p); }
  void Store(float* p) const { _mm512_storeu_ps(p, v); }
  static F16 Halves(F8 lo, F8 hi) {
    return {_mm512_castpd_ps(
        _mm512_insertf64x4(_mm512_castps_pd(_mm512_castps256_ps512(lo.v)), _mm256_castps_pd(hi.v), 1))};
  }
  [[nodiscard]] F8 lo() const { return {_mm512_castps512_ps256(v)}; }
  [[nodiscard]] F8 hi() const { return {_mm256_castpd_ps(_mm512_extractf64x4_pd(_mm512_castps_pd(v), 1))}; }
};
inline F16 operator+(F16 a, F16 b) { return {_mm512_add_ps(a.v, b.v)}; }
inline F16 operator-(F16 a, F16 b) { return {_mm512_sub_ps(a.v, b.v)}; }
inline F16 operator*(F16 a, F16 b) { return {_mm512_mul_ps(a.v, b.v)}; }
inline F16 operator/(F16 a, F16 b) { return {_mm512_div_ps(a.v, b.v)}; }
inline F16 operator&(F16 a, M16 mask) { return {_mm512_maskz_mov_ps(mask.m, a.v)}; }
inline F16 operator^(F16 a, F16 b) { return {_mm512_xor_ps(a.v, b.v)}; }
inline M16 operator>(F16 a, F16 b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_GT_OQ)}; }
inline M16 operator<(F16 a, F16 b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)}; }
inline F16 Sqrt(F16 a) { return {_mm512_sqrt_ps(a.v)}; }
inline F16 Max(F16 a, F16 b) { return {_mm512_max_ps(a.v, b.v)}; }
inline F16 Min(F16 a, F16 b) { return {_mm512_min_ps(a.v, b.v)}; }
inline F16 Select(M16 mask, F16 yes, F16 no) { return {_mm512_mask_blend_ps(mask.m, no.v, yes.v)}; }
inline F16 Abs(F16 a) { return {_mm512_abs_ps(a.v)}; }
inline F16 SignOf(F16 a) { return {_mm512_and_ps(a.v, _mm512_set1_ps(-0.0f))}; }

/// RotateDown and RotateUp of F8 in each half.
inline F16 RotateDown(F16 a) {
  return {_mm512_permutexvar_ps(_mm512_setr_epi32(1, 2, 3, 4, 5, 6, 7, 0, 9, 10, 11, 12, 13, 14, 15, 8), a.v)};
}
inline F16 RotateUp(F16 a) {
  return {_mm512_permutexvar_ps(_mm512_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6, 15, 8, 9, 10, 11, 12, 13, 14), a.v)};
}

inline void Transpose(F16* r0, F16* r1, F16* r2, F16* r3) {
  const __m512 a = _mm512_unpacklo_ps(r0->v, r1->v), b = _mm512_unpackhi_ps(r0->v, r1->v);
  const __m512 c = _mm512_unpacklo_ps(r2->v, r3->v), d = _mm512_unpackhi_ps(r2->v, r3->v);
  r0->v = _mm512_shuffle_ps(a, c, 0x44);
  r1->v = _mm512_shuffle_ps(a, c, 0xee);
  r2->v = _mm512_shuffle_ps(b, d, 0x44);
  r3->v = _mm512_shuffle_ps(b, d, 0xee);
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
