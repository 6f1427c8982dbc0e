// Eight floats: with AVX in one register, on the baseline in two. Included only by lanes.h, in the namespace of one
// instruction set, so that the linker cannot replace a function of one set by that of another.
#pragma once

#include <cstdint>

#include "physics_node/simd/sse.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

#if defined(__AVX__)

struct F8 {
  static constexpr int kBatches = 1;
  __m256 v;
  static F8 Load(const float* p) { return {_mm256_load_ps(p)}; }
  /// At any address.
  static F8 LoadAny(const float* p) { return {_mm256_loadu_ps(p)}; }
  static F8 All(float s) { return {_mm256_set1_ps(s)}; }
  static F8 Halves(__m128 lo, __m128 hi) { return {_mm256_set_m128(hi, lo)}; }
  void Store(float* p) const { _mm256_store_ps(p, v); }
  void StoreAny(float* p) const { _mm256_storeu_ps(p, v); }
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
template <int lane>
inline F8 Spread(F8 a) {
  return {_mm256_permute_ps(a.v, lane * 0x55)};
}

#else

struct F8 {
  static constexpr int kBatches = 1;
  __m128 l, h;
  static F8 Load(const float* p) { return {_mm_load_ps(p), _mm_load_ps(p + 4)}; }
  static F8 LoadAny(const float* p) { return {_mm_loadu_ps(p), _mm_loadu_ps(p + 4)}; }
  static F8 All(float s) { return {_mm_set1_ps(s), _mm_set1_ps(s)}; }
  static F8 Halves(__m128 lo, __m128 hi) { return {lo, hi}; }
  void Store(float* p) const {
    _mm_store_ps(p, l);
    _mm_store_ps(p + 4, h);
  }
  void StoreAny(float* p) const {
    _mm_storeu_ps(p, l);
    _mm_storeu_ps(p + 4, h);
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
/// Lane `lane` of each half in all lanes of that half.
template <int lane>
inline F8 Spread(F8 a) {
  return {_mm_shuffle_ps(a.l, a.l, lane * 0x55), _mm_shuffle_ps(a.h, a.h, lane * 0x55)};
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

/// Transposes the 4 x 4 floats in each half of four rows: xyzw particles to lanes of x, y, z and w, and back.
inline void Transpose(F8* r0, F8* r1, F8* r2, F8* r3) {
#if defined(__AVX__)
  const __m256 a = _mm256_unpacklo_ps(r0->v, r1->v), b = _mm256_unpackhi_ps(r0->v, r1->v);
  const __m256 c = _mm256_unpacklo_ps(r2->v, r3->v), d = _mm256_unpackhi_ps(r2->v, r3->v);
  r0->v = _mm256_shuffle_ps(a, c, 0x44);
  r1->v = _mm256_shuffle_ps(a, c, 0xee);
  r2->v = _mm256_shuffle_ps(b, d, 0x44);
  r3->v = _mm256_shuffle_ps(b, d, 0xee);
#else
  _MM_TRANSPOSE4_PS(r0->l, r1->l, r2->l, r3->l);
  _MM_TRANSPOSE4_PS(r0->h, r1->h, r2->h, r3->h);
#endif
}

/// pool[index[i] + plane * step[i]] in lane i.
inline F8 Gather(const float* pool, const std::uint32_t* index, const std::uint32_t* step, std::uint32_t plane) {
#if defined(__AVX2__)
  __m256i at = _mm256_load_si256(reinterpret_cast<const __m256i*>(index));
  for (std::uint32_t i = 0; i < plane; ++i) {
    at = _mm256_add_epi32(at, _mm256_load_si256(reinterpret_cast<const __m256i*>(step)));
  }
  return {_mm256_i32gather_ps(pool, at, 4)};
#else
  const auto value = [&](int i) { return pool[index[i] + plane * step[i]]; };
  return F8::Halves(_mm_set_ps(value(3), value(2), value(1), value(0)),
                    _mm_set_ps(value(7), value(6), value(5), value(4)));
#endif
}

/// Row i of the result holds the four floats at rows + index[i] and at rows + index[i + 4].
inline F8 LoadRow(const float* rows, const std::uint32_t* index, int i) {
  return F8::Halves(_mm_load_ps(rows + index[i]), _mm_load_ps(rows + index[i + 4]));
}
inline void StoreRow(F8 row, float* rows, const std::uint32_t* index, int i) {
  _mm_store_ps(rows + index[i], row.lo());
  _mm_store_ps(rows + index[i + 4], row.hi());
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
