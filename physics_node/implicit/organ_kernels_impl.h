// Kernels of the organ that visit each vertex: what its patches and edges do to it, its diagonal block, prediction and
// update. Compiled once per instruction set with FULCRUM_KERNEL_NAMESPACE set.
//
//   force     f_v = -sum_n V_n P_n g_nv - sum_j k_vj (x_v - x_j)          (n: patches that contain v, j: edges of v)
//   residual  r_v = f_v + l + m (g - s (x* - x_n) + v_n / h)
//   product   q_v = sum_n V_n dP_n g_nv + sum_j k_vj (p_v - p_j) + m s p_v
//   block     D_v = sum_n (u u^T + (k_n |g_nv|^2 + k_vn) I) + (k_e + m s) I,   u = sqrt(lambda V_n) cof F_n g_nv
//   inverse   kOrganRelaxation D_v^-1 = kOrganRelaxation cof D_v / det D_v
//   prediction, update: as those of the membrane (sheet_kernels_impl.h)
//
//   V_n, g_nv  volume of a patch at rest [m^3]; gradient of vertex v in it, F_n = sum_v x_v (x) g_nv [1/m]
//   P_n, dP_n  stress and its change along a direction p [Pa] (organ_patches_impl.h)
//   k_vj, k_e  stiffness of an edge in the variance term and of other elements [N/m]; k_n isotropic stiffness of a
//              patch [J]
//   x*, x_n, v_n   linearisation point [m]; position [m] and velocity [m/s] at the beginning of a substep of h [s]
//   m, l, g    mass [kg], dead load [N], gravity [m/s^2];  s = (1 + damping h) / h^2 [1/s^2]
//
// Layout. A vertex, or a column of a 3 x 3 matrix, is one register x y z _. For each vertex its patches follow one
// another (compressed rows): patch_gradient holds g_nv in x y z and k_vn in w, since the centre of patch n is vertex n.
// A patch leaves a line of 16 floats: three columns of V P (or V dP) and its centre's x (or p). So one product of
// that line with the four floats of patch_gradient yields the force of the patch and that of the edge.
#pragma once

#include "physics_node/implicit/kernels.h"
#include "physics_node/simd/sse.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

using implicit::Inertia;
using implicit::kFiniteSquare;
using implicit::kMatrixFloats;
using implicit::kStressFloats;
using implicit::kVertexFloats;
using implicit::Organ;
using implicit::OrganFields;
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
/// Of x y z; the fourth lane is left out.
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

/// Four columns xyz_ next to one another. In two registers even where one is enough: an addition waits four cycles for
/// the one before it, and two independent chains hide half of that.
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

/// sum over the patches n of vertex v of V P_n g_nv + k_vn (x_v - x_n).
inline F4 GatherVertex(const Organ& organ, const OrganMatrix& matrix, F4 here, std::uint32_t v) {
  const Quad centre = Quad::Fourth(here);
  Quad sum = Quad::Zero();
  for (std::uint32_t i = organ.patch_start[v]; i < organ.patch_start[v + 1]; ++i) {
    const Quad line = Quad::Load(matrix.stress + kStressFloats * static_cast<std::size_t>(organ.patch[i]));
    sum = sum +
          (line - centre) * Quad::Spread(F4::Load(organ.patch_gradient + kVertexFloats * static_cast<std::size_t>(i)));
  }
  const F4 keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  const F4 all = ((sum.Column<0>() + sum.Column<1>()) + sum.Column<2>()) - sum.Column<3>();
  return {_mm_and_ps(all.v, keep.v)};
}

inline void OrganResidual(const Organ& organ, const OrganMatrix& matrix, const Inertia& inertia,
                          const OrganFields& fields, std::uint32_t first, std::uint32_t last) {
  const F4 k = F4::All(inertia.inertia), inverse_h = F4::All(1.0f / inertia.h);
  const F4 gravity = {_mm_set_ps(0, inertia.gravity[2], inertia.gravity[1], inertia.gravity[0])};
  const F4 keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  for (std::uint32_t v = first; v < last; ++v) {
    const std::size_t i = kVertexFloats * static_cast<std::size_t>(v);
    const F4 here = F4::Load(fields.point + i);
    const F4 mass = F4::All(fields.start[i + 3] > 0.0f ? organ.mass[v] : 0.0f);
    const F4 momentum = (here - F4::Load(fields.start + i)) * k - F4::Load(fields.velocity + i) * inverse_h;
    const F4 force = F4::Load(fields.load + i) + (gravity - momentum) * mass - GatherVertex(organ, matrix, here, v);
    F4{_mm_and_ps(force.v, keep.v)}.Store(fields.residual + i);
  }
}

inline double OrganApply(const Organ& organ, const OrganMatrix& matrix, float inertia, const float* p, float* out,
                         std::uint32_t first, std::uint32_t last) {
  double sum = 0;
  for (std::uint32_t v = first; v < last; ++v) {
    const F4 here = F4::Load(p + kVertexFloats * static_cast<std::size_t>(v));
    const F4 result = GatherVertex(organ, matrix, here, v) + here * F4::All(organ.mass[v] * inertia);
    result.Store(out + kVertexFloats * static_cast<std::size_t>(v));
    sum += static_cast<double>(DotProduct(here, result));
  }
  return sum;
}

/// Factor of the inverse blocks (damped block Jacobi). Patches overlap by a dozen vertices, so their diagonal blocks
/// alone overshoot: the largest eigenvalue of the preconditioned matrix is 8. Modes that the right side hardly excites
/// then grow under a truncated solve; this factor brings it to 6, where they decay, and costs no accuracy.
constexpr float kOrganRelaxation = 0.6f;

inline void OrganBlocks(const Organ& organ, const OrganMatrix& matrix, const float* pool, const float* element_diagonal,
                        float inertia, std::uint32_t first, std::uint32_t last) {
  for (std::uint32_t v = first; v < last; ++v) {
    const std::size_t at = kMatrixFloats * static_cast<std::size_t>(v);
    if (!(pool[kVertexFloats * static_cast<std::size_t>(v) + 3] > 0.0f)) {
      StoreColumns({F4::All(0), F4::All(0), F4::All(0)}, F4::All(0), matrix.block + at);
      continue;
    }
    float own = element_diagonal[v] + organ.mass[v] * inertia;
    Columns k = {F4::All(0), F4::All(0), F4::All(0)};
    for (std::uint32_t i = organ.patch_start[v]; i < organ.patch_start[v + 1]; ++i) {
      const Columns c = LoadColumns(matrix.c + kMatrixFloats * static_cast<std::size_t>(organ.patch[i]));
      const F4 g = F4::Load(organ.patch_gradient + kVertexFloats * static_cast<std::size_t>(i));
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
    StoreColumns(cofactor, F4::All(kOrganRelaxation / DotProduct(k.c0, cofactor.c0)), matrix.block + at);
  }
}

inline double OrganBlockSolve(const OrganMatrix& matrix, const float* r, float* z, std::uint32_t first,
                              std::uint32_t last) {
  double sum = 0;
  for (std::uint32_t v = first; v < last; ++v) {
    const Columns block = LoadColumns(matrix.block + kMatrixFloats * static_cast<std::size_t>(v));
    const F4 b = F4::Load(r + kVertexFloats * static_cast<std::size_t>(v));
    const F4 result = block.c0 * SpreadLane<0>(b) + block.c1 * SpreadLane<1>(b) + block.c2 * SpreadLane<2>(b);
    result.Store(z + kVertexFloats * static_cast<std::size_t>(v));
    sum += static_cast<double>(DotProduct(b, result));
  }
  return sum;
}

inline implicit::PredictionCount OrganPredict(float h, float limit, const float* start, const float* velocity,
                                              float* point, std::uint32_t first, std::uint32_t last) {
  const F4 step = F4::All(h), keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  implicit::PredictionCount count{0, 0};
  for (std::size_t i = kVertexFloats * static_cast<std::size_t>(first);
       i < kVertexFloats * static_cast<std::size_t>(last); i += kVertexFloats) {
    const F4 x = F4::Load(start + i), d = F4::Load(velocity + i) * step;
    const float square = DotProduct(d, d);
    const bool moves = start[i + 3] > 0.0f, finite = square < kFiniteSquare;
    count.resets += moves && !finite ? 1 : 0;
    count.largest_sq = moves && finite ? Larger(square, count.largest_sq) : count.largest_sq;
    const F4 shift = square > limit * limit ? d * F4::All(limit / Root(square)) : d;
    F4{_mm_and_ps((moves && finite ? x + shift : x).v, keep.v)}.Store(point + i);
  }
  return count;
}

inline implicit::FinishCount OrganFinish(const float* point, const float* d, float h, float speed, float* pool,
                                         float* velocity, std::uint32_t first, std::uint32_t last) {
  const F4 step = F4::All(h), inverse_h = F4::All(1.0f / h);
  const F4 keep = {_mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))};
  implicit::FinishCount count{0, 0};
  for (std::size_t i = kVertexFloats * static_cast<std::size_t>(first);
       i < kVertexFloats * static_cast<std::size_t>(last); i += kVertexFloats) {
    const F4 from = F4::Load(pool + i);
    F4 v = ((F4::Load(point + i) + F4::Load(d + i)) - from) * inverse_h;
    v = {_mm_and_ps(v.v, keep.v)};
    float square = DotProduct(v, v);
    const bool moves = pool[i + 3] > 0.0f;
    if (!(square < kFiniteSquare)) {
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
  for (std::size_t i = kVertexFloats * static_cast<std::size_t>(first);
       i < kVertexFloats * static_cast<std::size_t>(last); i += kVertexFloats) {
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
  for (std::size_t i = kVertexFloats * static_cast<std::size_t>(first);
       i < kVertexFloats * static_cast<std::size_t>(last); i += kVertexFloats) {
    const F4 v = F4::Load(d + i);
    largest = Larger(DotProduct(v, v), largest);
  }
  return largest;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
