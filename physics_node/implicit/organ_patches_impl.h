// Kernels of the organ that visit each patch: deformation gradient, stress, its derivative, energy. Compiled once per
// instruction set, after organ_kernels_impl.h.
//
//   gradient    F  = sum_j x_j (x) g_j,  J = det F
//   energy      V Psi = V ((1 - a) mu/2 (|F|^2 - 3) - mu (J - 1) + lambda/2 (J - 1)^2) + sum edges k/2 |x_i - x_j|^2
//   stress      V P   = V ((1 - a) mu F + p cof F),   p = lambda (J - 1) - mu
//   derivative  V dP  = k dF + c (c : dF) + V q d(cof F)[dF],   c = sqrt(lambda V) cof F
//               q = fade(J) clamp(p, -mu/sigma, mu/sigma),   k = V ((1 - a) mu + |p - q| sigma)
//               fade(J) = clamp(kFadeSlope (J - kFlatJacobian), 0, 1)
//   curvature   p . A p = sum_n V dP_n : dF_n + sum edges k |p_i - p_j|^2 + sum m s |p|^2
//
//   x_j, g_j    position [m] of a vertex of the patch and its gradient [1/m]; sum_j g_j = 0
//   V, mu, lambda, a   volume at rest [m^3]; moduli [Pa], lambda that of Lamé + mu; share of mu in the edges
//   sigma       upper bound of the largest singular value of F
//   k           in energy and curvature: stiffness of an edge in the variance term [N/m]; else isotropic stiffness [J]
//   m, s        mass [kg], (1 + damping h) / h^2 [1/s^2]
//
// Law: stable neo-Hookean (Smith, de Goes and Kim 2018, eq. 13-14; energy/tet_energy.h) at nodal patches (Dohrmann et
// al. 2000), less the part of mu that the edges carry (energy/elastic_model.h). Its derivative together with the edges
// is positive semi-definite while |p| <= mu / sigma_max(F), so q is held there, and what is cut off is added as
// isotropic stiffness k: the matrix is never below the true one. The force stays exact.
//
// Layout. F is summed patch by patch in registers xyz_ (gather over its vertices); the law is computed for eight or
// sixteen patches at a time, one a lane (Group: kGroupFloats floats per patch, transposed on load):
//
//   group   F col 0 | F col 1 | F col 2 | edges | own vertex | _       (xyz_ each)
//   c, f    three columns xyz_ per patch, k in the fourth lanes of c
//   stress  three columns of V P or V dP, and x or p of the patch's own vertex: 16 floats per patch
#pragma once

#include "physics_node/implicit/organ_kernels_impl.h"
#include "physics_node/simd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Patches treated at a time.
constexpr std::uint32_t kPatchLanes = kLanes * Widest::kBatches;
static_assert(kPatchLanes <= implicit::kPatchGroup);

/// A 3 x 3 matrix a lane, by columns.
template <class F>
struct Matrix3 {
  V<F> c0, c1, c2;
};
template <class F>
FULCRUM_INLINE Matrix3<F> Scaled(const Matrix3<F>& m, F scale) {
  return {m.c0 * scale, m.c1 * scale, m.c2 * scale};
}
template <class F>
FULCRUM_INLINE Matrix3<F> Cofactor(const Matrix3<F>& f) {
  return {Cross(f.c1, f.c2), Cross(f.c2, f.c0), Cross(f.c0, f.c1)};
}
template <class F>
FULCRUM_INLINE F Dot(const Matrix3<F>& a, const Matrix3<F>& b) {
  return (a.c0.x * b.c0.x + a.c1.x * b.c1.x + a.c2.x * b.c2.x) + (a.c0.y * b.c0.y + a.c1.y * b.c1.y + a.c2.y * b.c2.y) +
         (a.c0.z * b.c0.z + a.c1.z * b.c1.z + a.c2.z * b.c2.z);
}

/// Offsets of lanes that follow each other at a distance of `stride` floats.
template <std::uint32_t stride>
struct LaneOffsets {
  std::uint32_t at[implicit::kPatchGroup];
  constexpr LaneOffsets() : at{} {
    for (std::uint32_t i = 0; i < implicit::kPatchGroup; ++i) {
      at[i] = stride * i;
    }
  }
};
template <std::uint32_t stride>
constexpr LaneOffsets<stride> kLaneOffsets;

/// A vector xyzw a patch, `stride` floats from one patch to the next.
template <std::uint32_t stride, class F>
FULCRUM_INLINE Particles<F> LoadPatches(const float* first) {
  return GatherXyzw<F>(first, kLaneOffsets<stride>.at, kLanes);
}
template <std::uint32_t stride, class F>
FULCRUM_INLINE void StorePatches(const V<F>& v, F fourth, float* first) {
  ScatterXyzw<F>({v, fourth}, first, kLaneOffsets<stride>.at, kLanes);
}
template <std::uint32_t stride, class F>
FULCRUM_INLINE Matrix3<F> LoadColumns3(const float* first) {
  return {LoadPatches<stride, F>(first).p, LoadPatches<stride, F>(first + 4).p, LoadPatches<stride, F>(first + 8).p};
}
template <std::uint32_t stride, class F>
FULCRUM_INLINE void StoreColumns3(const Matrix3<F>& m, F fourth, float* first) {
  StorePatches<stride, F>(m.c0, fourth, first);
  StorePatches<stride, F>(m.c1, fourth, first + 4);
  StorePatches<stride, F>(m.c2, fourth, first + 8);
}

/// Gathered data of a group of patches, by patch: three columns of a gradient, a sum over edges, the own vertex, and
/// four floats that keep the stride a multiple of eight.
constexpr std::uint32_t kGroupFloats = 24, kEdgesAt = 12, kOwnVertexAt = 16;
struct Group {
  alignas(64) float data[kPatchLanes * kGroupFloats];
  std::uint32_t first, count;  ///< Lanes from `count` on are empty.

  [[nodiscard]] float* Of(std::uint32_t lane) { return data + kGroupFloats * lane; }
};

/// Calls body(group) for patches [first, last), `gather(n, data)` before it for each of them.
template <class Gather, class Body>
FULCRUM_INLINE void ForGroups(std::uint32_t first, std::uint32_t last, const Gather& gather, const Body& body) {
  Group group;
  for (group.first = first; group.first < last; group.first += kPatchLanes) {
    const std::uint32_t left = last - group.first;
    group.count = left < kPatchLanes ? left : kPatchLanes;
    for (std::uint32_t i = 0; i < group.count; ++i) {
      gather(group.first + i, group.Of(i));
    }
    for (std::uint32_t i = kGroupFloats * group.count; i < kGroupFloats * kPatchLanes; ++i) {
      group.data[i] = 0;
    }
    body(group);
  }
}

inline void StoreQuad(const Quad& q, float* to) {
  q.Column<0>().Store(to);
  q.Column<1>().Store(to + 4);
  q.Column<2>().Store(to + 8);
  q.Column<3>().Store(to + 12);
}

/// sum x_j (x) g_j over the patch of vertex n.
inline Quad PatchGradient(const Organ& organ, const float* tube, std::uint32_t n) {
  Quad f = Quad::Zero();
  for (std::uint32_t i = organ.start[n]; i < organ.start[n + 1]; ++i) {
    const F4 x = F4::Load(tube + kVertexFloats * static_cast<std::size_t>(organ.vertex[i]));
    f = f + Quad::Repeat(x) * Quad::Spread(F4::Load(organ.gradient + kVertexFloats * static_cast<std::size_t>(i)));
  }
  return f;
}

/// Writes what the vertices of the patches gather: their stress, and in the fourth column their own vertices of `p`.
template <class F>
FULCRUM_INLINE void StoreStress(const Matrix3<F>& stress, const float* p, const Group& group, float* lines) {
  alignas(64) float buffer[kPatchLanes * kStressFloats];
  float* const own = lines + kStressFloats * static_cast<std::size_t>(group.first);
  const bool whole = group.count == kPatchLanes;
  StoreColumns3<kStressFloats>(stress, F::All(0), whole ? own : buffer);
  for (std::uint32_t i = 0; i < group.count; ++i) {
    float* const line = own + kStressFloats * i;
    for (std::uint32_t c = 0; !whole && c < kMatrixFloats; c += kVertexFloats) {
      F4::Load(buffer + kStressFloats * i + c).Store(line + c);
    }
    F4::Load(p + kVertexFloats * static_cast<std::size_t>(group.first + i)).Store(line + kMatrixFloats);
  }
}

/// Upper bound of sigma_max(F)^2: Gershgorin on F^T F, tight near rest.
template <class F>
FULCRUM_INLINE F LargestStretchSq(const Matrix3<F>& f) {
  const F a01 = Abs(Dot(f.c0, f.c1)), a02 = Abs(Dot(f.c0, f.c2)), a12 = Abs(Dot(f.c1, f.c2));
  return Max(Max(Dot(f.c0, f.c0) + a01 + a02, Dot(f.c1, f.c1) + a01 + a12), Dot(f.c2, f.c2) + a02 + a12);
}

/// Least sigma^2 that is divided by: a patch collapsed to a millionth of its size.
constexpr float kLeastStretchSquare = 1e-12f;
/// Flattened and inverted patches leave the indefinite part q out altogether, from J = 0.5 down to 0.1 gradually:
/// sigma is then no measure of what cof F does, and the isotropic stiffness alone is a bound. Assumed.
constexpr float kFlatJacobian = 0.1f, kFadeSlope = 2.5f;

inline void OrganLinearise(const Organ& organ, const OrganMatrix& matrix, const float* point, std::uint32_t first,
                           std::uint32_t last) {
  using F = Widest;
  const auto gather = [&](std::uint32_t n, float* data) { StoreQuad(PatchGradient(organ, point, n), data); };
  ForGroups(first, last, gather, [&](Group& group) {
    const Matrix3<F> f = LoadColumns3<kGroupFloats, F>(group.data), cofactor = Cofactor(f);
    const F lambda = F::All(organ.lambda), mu = F::All(organ.mu), volume = F::LoadAny(organ.volume + group.first);
    const F shear = F::LoadAny(organ.shear + group.first);
    const F j = Dot(f.c0, cofactor.c0), pressure = lambda * (j - F::All(1.0f)) - mu;
    const Matrix3<F> stress = {f.c0 * shear + cofactor.c0 * pressure, f.c1 * shear + cofactor.c1 * pressure,
                               f.c2 * shear + cofactor.c2 * pressure};
    StoreStress(Scaled(stress, volume), point, group, matrix.stress);
    const F sigma = Sqrt(Max(LargestStretchSq(f), F::All(kLeastStretchSquare))), bound = mu / sigma;
    const F fade = Min(Max((j - F::All(kFlatJacobian)) * F::All(kFadeSlope), F::All(0)), F::All(1.0f));
    const F q = Max(Min(pressure, bound), bound ^ F::All(-0.0f)) * fade;
    const F stiffness = (shear + Abs(pressure - q) * sigma) * volume;
    alignas(64) float buffer[2][kPatchLanes * kMatrixFloats];
    const std::size_t at = kMatrixFloats * static_cast<std::size_t>(group.first);
    const bool whole = group.count == kPatchLanes;
    StoreColumns3<kMatrixFloats>(Scaled(cofactor, Sqrt(lambda * volume)), stiffness, whole ? matrix.c + at : buffer[0]);
    StoreColumns3<kMatrixFloats>(Scaled(f, q * volume), F::All(0), whole ? matrix.f + at : buffer[1]);
    for (std::uint32_t i = 0; !whole && i < kMatrixFloats * group.count; ++i) {
      matrix.c[at + i] = buffer[0][i];
      matrix.f[at + i] = buffer[1][i];
    }
  });
}

/// V dP of patches from `n` on whose vertices move with gradients `d`.
template <class F>
FULCRUM_INLINE Matrix3<F> StressAlong(const OrganMatrix& matrix, const Matrix3<F>& d, std::uint32_t n) {
  constexpr std::uint32_t kStride = kMatrixFloats;
  const std::size_t at = kMatrixFloats * static_cast<std::size_t>(n);
  const Particles<F> first = LoadPatches<kStride, F>(matrix.c + at);
  const Matrix3<F> c = {first.p, LoadPatches<kStride, F>(matrix.c + at + 4).p,
                        LoadPatches<kStride, F>(matrix.c + at + 8).p};
  const Matrix3<F> f = LoadColumns3<kStride, F>(matrix.f + at);
  const F shear = first.w, along = Dot(c, d);
  // d(cof F)[dF], columns: dF1 x F2 + F1 x dF2 and so on.
  return {d.c0 * shear + c.c0 * along + (Cross(d.c1, f.c2) + Cross(f.c1, d.c2)),
          d.c1 * shear + c.c1 * along + (Cross(d.c2, f.c0) + Cross(f.c2, d.c0)),
          d.c2 * shear + c.c2 * along + (Cross(d.c0, f.c1) + Cross(f.c0, d.c1))};
}

inline void OrganStress(const Organ& organ, const OrganMatrix& matrix, const float* p, std::uint32_t first,
                        std::uint32_t last) {
  const auto gather = [&](std::uint32_t n, float* data) { StoreQuad(PatchGradient(organ, p, n), data); };
  ForGroups(first, last, gather, [&](Group& group) {
    StoreStress(StressAlong(matrix, LoadColumns3<kGroupFloats, Widest>(group.data), group.first), p, group,
                matrix.stress);
  });
}

inline double OrganCurvature(const Organ& organ, const OrganMatrix& matrix, float inertia, const float* p,
                             std::uint32_t first, std::uint32_t last) {
  using F = Widest;
  double sum = 0;
  const auto gather = [&](std::uint32_t n, float* data) {
    const F4 here = F4::Load(p + kVertexFloats * static_cast<std::size_t>(n));
    const Quad centre = Quad::Repeat(here);
    Quad f = Quad::Zero();
    for (std::uint32_t i = organ.start[n]; i < organ.start[n + 1]; ++i) {
      const F4 x = F4::Load(p + kVertexFloats * static_cast<std::size_t>(organ.vertex[i]));
      f = f + (Quad::Repeat(x) - centre) *
                  Quad::Spread(F4::Load(organ.gradient + kVertexFloats * static_cast<std::size_t>(i)));
    }
    StoreQuad(f, data);
    here.Store(data + kOwnVertexAt);
  };
  ForGroups(first, last, gather, [&](Group& group) {
    // The gradients of a patch sum to 0, so its vertices may be taken relative to its own.
    const Matrix3<F> d = LoadColumns3<kGroupFloats, F>(group.data);
    const Matrix3<F> stress = StressAlong(matrix, d, group.first);
    StoreStress(stress, p, group, matrix.stress);
    // Each edge is visited from both ends and contributes the share of that end.
    const V<F> edges = LoadPatches<kGroupFloats, F>(group.data + kEdgesAt).p,
               here = LoadPatches<kGroupFloats, F>(group.data + kOwnVertexAt).p;
    const V<F> own = here * (F::LoadAny(organ.mass + group.first) * F::All(inertia)) - edges;
    alignas(64) float of_patch[kPatchLanes];
    (Dot(stress, d) + Dot(here, own)).Store(of_patch);
    for (std::uint32_t i = 0; i < group.count; ++i) {
      sum += static_cast<double>(of_patch[i]);
    }
  });
  return sum;
}

inline double OrganEnergy(const Organ& organ, const Inertia& inertia, const OrganFields& fields, std::uint32_t first,
                          std::uint32_t last) {
  using F = Widest;
  const F4 gravity = {_mm_set_ps(0, inertia.gravity[2], inertia.gravity[1], inertia.gravity[0])};
  const F4 half = F4::All(0.5f * inertia.inertia), inverse_h = F4::All(1.0f / inertia.h);
  double sum = 0;
  const auto gather = [&](std::uint32_t n, float* data) {
    StoreQuad(PatchGradient(organ, fields.point, n), data);
    const std::size_t i = kVertexFloats * static_cast<std::size_t>(n);
    const F4 here = F4::Load(fields.point + i);
    F4 edges = F4::All(0);
    for (std::uint32_t k = organ.patch_start[n]; k < organ.patch_start[n + 1]; ++k) {
      const F4 d = here - F4::Load(fields.point + kVertexFloats * static_cast<std::size_t>(organ.patch[k]));
      edges = edges + d * d * F4::All(organ.patch_gradient[kVertexFloats * static_cast<std::size_t>(k) + 3]);
    }
    // Half of k/2 |x_i - x_j|^2, since each edge is visited from both ends.
    sum += 0.25 * static_cast<double>(DotProduct(edges, F4::All(1.0f)));
    if (fields.start[i + 3] > 0.0f) {
      const F4 moved = here - F4::Load(fields.start + i);
      const F4 momentum = moved * half - F4::Load(fields.velocity + i) * inverse_h - gravity;
      sum += static_cast<double>(organ.mass[n] * DotProduct(moved, momentum) -
                                 DotProduct(moved, F4::Load(fields.load + i)));
    }
  };
  ForGroups(first, last, gather, [&](Group& group) {
    const Matrix3<F> f = LoadColumns3<kGroupFloats, F>(group.data);
    const F j = Dot(f.c0, Cross(f.c1, f.c2)) - F::All(1.0f);
    const F density = F::All(0.5f) * F::LoadAny(organ.shear + group.first) * (Dot(f, f) - F::All(3.0f)) -
                      F::All(organ.mu) * j + F::All(0.5f * organ.lambda) * (j * j);
    alignas(64) float of_patch[kPatchLanes];
    (density * F::LoadAny(organ.volume + group.first)).Store(of_patch);
    for (std::uint32_t i = 0; i < group.count; ++i) {
      sum += static_cast<double>(of_patch[i]);
    }
  });
  return sum;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
