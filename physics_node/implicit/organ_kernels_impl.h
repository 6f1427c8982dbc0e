// Bodies of the organ's kernels, compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set: a vertex or a
// column of a 3 x 3 matrix is one register xyz_. Those that go over patches are in organ_patches_impl.h.
#pragma once

#include "physics_node/implicit/kernels.h"
#include "physics_node/simd/sse.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using implicit::Inertia;
using implicit::Organ;
using implicit::OrganLinearisation;
using implicit::OrganMatrix;

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

/// Four columns xyz_ next to one another. In two registers even where one would do: sums of four cycles each follow one
/// another, and two of them hide more of that than one.
struct Quad {
#if defined(__AVX__)
  __m256 a, b;
  static Quad Load(const float* p) { return {_mm256_load_ps(p), _mm256_load_ps(p + 8)}; }
  static Quad Zero() { return {_mm256_setzero_ps(), _mm256_setzero_ps()}; }
  static Quad Repeat(F4 c) {
    const __m256 both = _mm256_set_m128(c.v, c.v);
    return {both, both};
  }
  static Quad Spread(F4 c) {
    const __m256 both = _mm256_set_m128(c.v, c.v);
    return {_mm256_permutevar_ps(both, _mm256_set_epi32(1, 1, 1, 1, 0, 0, 0, 0)),
            _mm256_permutevar_ps(both, _mm256_set_epi32(3, 3, 3, 3, 2, 2, 2, 2))};
  }
  static Quad Fourth(F4 c) { return {_mm256_setzero_ps(), _mm256_set_m128(c.v, _mm_setzero_ps())}; }
  template <int i>
  [[nodiscard]] F4 Column() const {
    const __m256 half = i < 2 ? a : b;
    return {i % 2 == 0 ? _mm256_castps256_ps128(half) : _mm256_extractf128_ps(half, 1)};
  }
#else
  F4 c[4];
  static Quad Load(const float* p) { return {{F4::Load(p), F4::Load(p + 4), F4::Load(p + 8), F4::Load(p + 12)}}; }
  static Quad Zero() { return {{F4::All(0), F4::All(0), F4::All(0), F4::All(0)}}; }
  static Quad Repeat(F4 a) { return {{a, a, a, a}}; }
  static Quad Spread(F4 a) { return {{SpreadLane<0>(a), SpreadLane<1>(a), SpreadLane<2>(a), SpreadLane<3>(a)}}; }
  static Quad Fourth(F4 a) { return {{F4::All(0), F4::All(0), F4::All(0), a}}; }
  template <int i>
  [[nodiscard]] F4 Column() const {
    return c[i];
  }
#endif
};
#if defined(__AVX__)
inline Quad operator+(Quad a, Quad b) { return {_mm256_add_ps(a.a, b.a), _mm256_add_ps(a.b, b.b)}; }
inline Quad operator-(Quad a, Quad b) { return {_mm256_sub_ps(a.a, b.a), _mm256_sub_ps(a.b, b.b)}; }
inline Quad operator*(Quad a, Quad b) { return {_mm256_mul_ps(a.a, b.a), _mm256_mul_ps(a.b, b.b)}; }
#else
inline Quad operator+(const Quad& a, const Quad& b) {
  return {{a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2], a.c[3] + b.c[3]}};
}
inline Quad operator-(const Quad& a, const Quad& b) {
  return {{a.c[0] - b.c[0], a.c[1] - b.c[1], a.c[2] - b.c[2], a.c[3] - b.c[3]}};
}
inline Quad operator*(const Quad& a, const Quad& b) {
  return {{a.c[0] * b.c[0], a.c[1] * b.c[1], a.c[2] * b.c[2], a.c[3] * b.c[3]}};
}
#endif

inline float Larger(float a, float b) { return a > b ? a : b; }
inline float Root(float v) { return _mm_cvtss_f32(_mm_sqrt_ss(_mm_set_ss(v))); }

/// sum over the patches of vertex v of stress * gradient + stiffness * (x_v - x_n).
inline F4 GatherVertex(const Organ& organ, const OrganMatrix& matrix, F4 here, std::uint32_t v) {
  const Quad centre = Quad::Fourth(here);
  Quad sum = Quad::Zero();
  for (std::uint32_t i = organ.patch_start[v]; i < organ.patch_start[v + 1]; ++i) {
    const Quad line = Quad::Load(matrix.stress + 16 * static_cast<std::size_t>(organ.patch[i]));
    sum = sum + (line - centre) * Quad::Spread(F4::Load(organ.patch_gradient + 4 * static_cast<std::size_t>(i)));
  }
  const F4 keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  const F4 all = ((sum.Column<0>() + sum.Column<1>()) + sum.Column<2>()) - sum.Column<3>();
  return {_mm_and_ps(all.v, keep.v)};
}

inline void OrganResidual(const Organ& organ, const OrganMatrix& matrix, const Inertia& inertia,
                          const OrganLinearisation& at, std::uint32_t first, std::uint32_t last) {
  const F4 k = F4::All(inertia.inertia), inverse_h = F4::All(1.0f / inertia.h);
  const F4 gravity = {_mm_set_ps(0, inertia.gravity[2], inertia.gravity[1], inertia.gravity[0])};
  const F4 keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  for (std::uint32_t v = first; v < last; ++v) {
    const std::size_t i = 4 * static_cast<std::size_t>(v);
    const F4 here = F4::Load(at.place + i);
    const F4 mass = F4::All(at.start[i + 3] > 0.0f ? organ.mass[v] : 0.0f);
    const F4 momentum = (here - F4::Load(at.start + i)) * k - F4::Load(at.velocity + i) * inverse_h;
    const F4 force = F4::Load(at.load + i) + (gravity - momentum) * mass - GatherVertex(organ, matrix, here, v);
    F4{_mm_and_ps(force.v, keep.v)}.Store(at.residual + i);
  }
}

inline double OrganApply(const Organ& organ, const OrganMatrix& matrix, float inertia, const float* p, float* out,
                         std::uint32_t first, std::uint32_t last) {
  double sum = 0;
  for (std::uint32_t v = first; v < last; ++v) {
    const F4 here = F4::Load(p + 4 * static_cast<std::size_t>(v));
    const F4 result = GatherVertex(organ, matrix, here, v) + here * F4::All(organ.mass[v] * inertia);
    result.Store(out + 4 * static_cast<std::size_t>(v));
    sum += static_cast<double>(DotProduct(here, result));
  }
  return sum;
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

inline double OrganBlockSolve(const OrganMatrix& matrix, const float* r, float* z, std::uint32_t first,
                              std::uint32_t last) {
  double sum = 0;
  for (std::uint32_t v = first; v < last; ++v) {
    const Columns block = LoadColumns(matrix.block + 12 * static_cast<std::size_t>(v));
    const F4 b = F4::Load(r + 4 * static_cast<std::size_t>(v));
    const F4 result = block.c0 * SpreadLane<0>(b) + block.c1 * SpreadLane<1>(b) + block.c2 * SpreadLane<2>(b);
    result.Store(z + 4 * static_cast<std::size_t>(v));
    sum += static_cast<double>(DotProduct(b, result));
  }
  return sum;
}

inline implicit::GuessCount OrganGuess(float h, float limit, const float* start, const float* velocity, float* place,
                                       std::uint32_t first, std::uint32_t last) {
  const F4 step = F4::All(h), keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  implicit::GuessCount count{0, 0};
  for (std::size_t i = 4 * static_cast<std::size_t>(first); i < 4 * static_cast<std::size_t>(last); i += 4) {
    const F4 x = F4::Load(start + i), d = F4::Load(velocity + i) * step;
    const float square = DotProduct(d, d);
    const bool moves = start[i + 3] > 0.0f, sound = square < 1e30f;
    count.resets += moves && !sound ? 1 : 0;
    count.largest_sq = moves && sound ? Larger(square, count.largest_sq) : count.largest_sq;
    const F4 way = square > limit * limit ? d * F4::All(limit / Root(square)) : d;
    F4{_mm_and_ps((moves && sound ? x + way : x).v, keep.v)}.Store(place + i);
  }
  return count;
}

inline implicit::FinishCount OrganFinish(const float* place, const float* d, float h, float speed, float* pool,
                                         float* velocity, std::uint32_t first, std::uint32_t last) {
  const F4 step = F4::All(h), inverse_h = F4::All(1.0f / h);
  const F4 keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  implicit::FinishCount count{0, 0};
  for (std::size_t i = 4 * static_cast<std::size_t>(first); i < 4 * static_cast<std::size_t>(last); i += 4) {
    const F4 from = F4::Load(pool + i);
    F4 v = ((F4::Load(place + i) + F4::Load(d + i)) - from) * inverse_h;
    v = {_mm_and_ps(v.v, keep.v)};
    float square = DotProduct(v, v);
    const bool moves = pool[i + 3] > 0.0f;
    if (!(square < 1e30f)) {
      count.resets += moves ? 1 : 0;
      F4::All(0).Store(velocity + i);
      continue;
    }
    if (square > speed * speed) {
      v = v * F4::All(speed / Root(square));
      square = speed * speed;
    }
    count.largest_speed_sq = moves ? Larger(square, count.largest_speed_sq) : count.largest_speed_sq;
    v.Store(velocity + i);
    (from + v * step).Store(pool + i);
  }
  return count;
}

inline float OrganStep(float a, const float* p, float b, const float* z, bool adds, float* d, std::uint32_t first,
                       std::uint32_t last) {
  const F4 of_p = F4::All(a), of_z = F4::All(b);
  float largest = 0;
  for (std::size_t i = 4 * static_cast<std::size_t>(first); i < 4 * static_cast<std::size_t>(last); i += 4) {
    F4 v = F4::Load(p + i) * of_p + F4::Load(z + i) * of_z;
    if (adds) {
      v = F4::Load(d + i) + v;
    }
    v.Store(d + i);
    largest = Larger(DotProduct(v, v), largest);
  }
  return largest;
}

inline float OrganLargest(const float* d, std::uint32_t first, std::uint32_t last) {
  float largest = 0;
  for (std::size_t i = 4 * static_cast<std::size_t>(first); i < 4 * static_cast<std::size_t>(last); i += 4) {
    const F4 v = F4::Load(d + i);
    largest = Larger(DotProduct(v, v), largest);
  }
  return largest;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
