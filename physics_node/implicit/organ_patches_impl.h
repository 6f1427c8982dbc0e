// Kernels that go over the organ's patches, compiled once per instruction set after organ_kernels_impl.h. Gradients are
// summed patch by patch; what the law makes of them is computed for eight or sixteen patches at a time, one a lane.
//
// The law at a patch: stable neo-Hookean (energy/tet_energy.h) less the part of mu that the edges carry. Its
// derivative,
//   dP = (1 - a) mu dF + lambda (cof F : dF) cof F + p d(cof F)[dF],   p = lambda (J - 1) - mu,
// together with the edges is positive semi-definite while |p| <= mu / sigma_max(F), so p is held there; the force stays
// exact.
#pragma once

#include "physics_node/implicit/organ_kernels_impl.h"
#include "physics_node/simd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Patches treated at a time.
constexpr std::uint32_t kPatchLanes = 8 * Widest::kBatches;
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

/// Where lanes stand that follow each other at a distance of `stride` floats.
template <std::uint32_t stride>
struct Apart {
  std::uint32_t at[16];
  constexpr Apart() : at{} {
    for (std::uint32_t i = 0; i < 16; ++i) {
      at[i] = stride * i;
    }
  }
};
template <std::uint32_t stride>
constexpr Apart<stride> kApart;

/// A vector xyzw a patch, `stride` floats from one patch to the next.
template <std::uint32_t stride, class F>
FULCRUM_INLINE Particles<F> LoadPatches(const float* first) {
  return GatherXyzw<F>(first, kApart<stride>.at, 8);
}
template <std::uint32_t stride, class F>
FULCRUM_INLINE void StorePatches(const V<F>& v, F fourth, float* first) {
  ScatterXyzw<F>({v, fourth}, first, kApart<stride>.at, 8);
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

/// What is known of a group of patches, by patch: three columns of a gradient, and two vectors more.
constexpr std::uint32_t kKnown = 24;
struct Group {
  alignas(64) float known[kPatchLanes * kKnown];
  std::uint32_t first, count;  ///< Lanes from `count` on are empty.

  [[nodiscard]] float* Of(std::uint32_t lane) { return known + kKnown * lane; }
};

/// Calls body(group) for patches [first, last), `gather(n, known)` before it for each of them.
template <class Gather, class Body>
FULCRUM_INLINE void ForGroups(std::uint32_t first, std::uint32_t last, const Gather& gather, const Body& body) {
  Group group;
  for (group.first = first; group.first < last; group.first += kPatchLanes) {
    const std::uint32_t left = last - group.first;
    group.count = left < kPatchLanes ? left : kPatchLanes;
    for (std::uint32_t i = 0; i < group.count; ++i) {
      gather(group.first + i, group.Of(i));
    }
    for (std::uint32_t i = kKnown * group.count; i < kKnown * kPatchLanes; ++i) {
      group.known[i] = 0;
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
    const F4 x = F4::Load(tube + 4 * static_cast<std::size_t>(organ.vertex[i]));
    f = f + Quad::Repeat(x) * Quad::Spread(F4::Load(organ.gradient + 4 * static_cast<std::size_t>(i)));
  }
  return f;
}

/// What the vertices of the patches gather: their stress, and in the fourth column where their own vertices are.
template <class F>
FULCRUM_INLINE void StoreStress(const Matrix3<F>& stress, const float* p, const Group& group, float* lines) {
  alignas(64) float rest[kPatchLanes * 16];
  float* const own = lines + 16 * static_cast<std::size_t>(group.first);
  const bool whole = group.count == kPatchLanes;
  StoreColumns3<16>(stress, F::All(0), whole ? own : rest);
  for (std::uint32_t i = 0; i < group.count; ++i) {
    float* const line = own + 16 * i;
    for (std::uint32_t c = 0; !whole && c < 12; c += 4) {
      F4::Load(rest + 16 * i + c).Store(line + c);
    }
    F4::Load(p + 4 * static_cast<std::size_t>(group.first + i)).Store(line + 12);
  }
}

/// Upper bound of sigma_max(F)^2: Gershgorin on F^T F, tight near rest.
template <class F>
FULCRUM_INLINE F LargestStretchSq(const Matrix3<F>& f) {
  const F a01 = Abs(Dot(f.c0, f.c1)), a02 = Abs(Dot(f.c0, f.c2)), a12 = Abs(Dot(f.c1, f.c2));
  return Max(Max(Dot(f.c0, f.c0) + a01 + a02, Dot(f.c1, f.c1) + a01 + a12), Dot(f.c2, f.c2) + a02 + a12);
}

inline void OrganLinearise(const Organ& organ, const OrganMatrix& matrix, const float* place, std::uint32_t first,
                           std::uint32_t last) {
  using F = Widest;
  const auto gather = [&](std::uint32_t n, float* known) { StoreQuad(PatchGradient(organ, place, n), known); };
  ForGroups(first, last, gather, [&](Group& group) {
    const Matrix3<F> f = LoadColumns3<kKnown, F>(group.known), cofactor = Cofactor(f);
    const F lambda = F::All(organ.lambda), mu = F::All(organ.mu), volume = F::Load(organ.volume + group.first);
    const F shear = F::All((1.0f - organ.variance) * organ.mu);
    const F j = Dot(f.c0, cofactor.c0), pressure = lambda * (j - F::All(1.0f)) - mu;
    const Matrix3<F> stress = {f.c0 * shear + cofactor.c0 * pressure, f.c1 * shear + cofactor.c1 * pressure,
                               f.c2 * shear + cofactor.c2 * pressure};
    StoreStress(Scaled(stress, volume), place, group, matrix.stress);
    const F sigma = Sqrt(Max(LargestStretchSq(f), F::All(1e-12f))), bound = mu / sigma;
    // Flattened and inverted patches leave the indefinite part out altogether.
    const F fade = Min(Max((j - F::All(0.1f)) * F::All(2.5f), F::All(0)), F::All(1.0f));
    const F q = Max(Min(pressure, bound), bound ^ F::All(-0.0f)) * fade;
    const F stiffness = (shear + Abs(pressure - q) * sigma) * volume;
    alignas(64) float rest[2][kPatchLanes * 12];
    const std::size_t at = 12 * static_cast<std::size_t>(group.first);
    const bool whole = group.count == kPatchLanes;
    StoreColumns3<12>(Scaled(cofactor, Sqrt(lambda * volume)), stiffness, whole ? matrix.c + at : rest[0]);
    StoreColumns3<12>(Scaled(f, q * volume), F::All(0), whole ? matrix.f + at : rest[1]);
    for (std::uint32_t i = 0; !whole && i < 12 * group.count; ++i) {
      matrix.c[at + i] = rest[0][i];
      matrix.f[at + i] = rest[1][i];
    }
  });
}

/// V dP of patches from `n` on whose vertices move with gradients `d`.
template <class F>
FULCRUM_INLINE Matrix3<F> StressAlong(const OrganMatrix& matrix, const Matrix3<F>& d, std::uint32_t n) {
  const std::size_t at = 12 * static_cast<std::size_t>(n);
  const Particles<F> first = LoadPatches<12, F>(matrix.c + at);
  const Matrix3<F> c = {first.p, LoadPatches<12, F>(matrix.c + at + 4).p, LoadPatches<12, F>(matrix.c + at + 8).p};
  const Matrix3<F> f = LoadColumns3<12, F>(matrix.f + at);
  const F shear = first.w, along = Dot(c, d);
  // d(cof F)[dF], columns: dF1 x F2 + F1 x dF2 and so on.
  return {d.c0 * shear + c.c0 * along + (Cross(d.c1, f.c2) + Cross(f.c1, d.c2)),
          d.c1 * shear + c.c1 * along + (Cross(d.c2, f.c0) + Cross(f.c2, d.c0)),
          d.c2 * shear + c.c2 * along + (Cross(d.c0, f.c1) + Cross(f.c0, d.c1))};
}

inline void OrganStress(const Organ& organ, const OrganMatrix& matrix, const float* p, std::uint32_t first,
                        std::uint32_t last) {
  const auto gather = [&](std::uint32_t n, float* known) { StoreQuad(PatchGradient(organ, p, n), known); };
  ForGroups(first, last, gather, [&](Group& group) {
    StoreStress(StressAlong(matrix, LoadColumns3<kKnown, Widest>(group.known), group.first), p, group, matrix.stress);
  });
}

inline double OrganCurvature(const Organ& organ, const OrganMatrix& matrix, float inertia, const float* p,
                             std::uint32_t first, std::uint32_t last) {
  using F = Widest;
  double sum = 0;
  const auto gather = [&](std::uint32_t n, float* known) {
    const F4 here = F4::Load(p + 4 * static_cast<std::size_t>(n));
    const Quad centre = Quad::Repeat(here);
    Quad f = Quad::Zero();
    for (std::uint32_t i = organ.start[n]; i < organ.start[n + 1]; ++i) {
      const F4 x = F4::Load(p + 4 * static_cast<std::size_t>(organ.vertex[i]));
      f = f + (Quad::Repeat(x) - centre) * Quad::Spread(F4::Load(organ.gradient + 4 * static_cast<std::size_t>(i)));
    }
    StoreQuad(f, known);
    here.Store(known + 16);
  };
  ForGroups(first, last, gather, [&](Group& group) {
    // The gradients of a patch add up to 0, so its vertices may be measured from its own.
    const Matrix3<F> d = LoadColumns3<kKnown, F>(group.known);
    const Matrix3<F> stress = StressAlong(matrix, d, group.first);
    StoreStress(stress, p, group, matrix.stress);
    // Each edge is met from both ends, and from each has the share of that end.
    const V<F> edges = LoadPatches<kKnown, F>(group.known + 12).p, here = LoadPatches<kKnown, F>(group.known + 16).p;
    const V<F> own = here * (F::Load(organ.mass + group.first) * F::All(inertia)) - edges;
    alignas(64) float of_patch[kPatchLanes];
    (Dot(stress, d) + Dot(here, own)).Store(of_patch);
    for (std::uint32_t i = 0; i < group.count; ++i) {
      sum += static_cast<double>(of_patch[i]);
    }
  });
  return sum;
}

inline double OrganEnergy(const Organ& organ, const Inertia& inertia, const OrganLinearisation& at, std::uint32_t first,
                          std::uint32_t last) {
  using F = Widest;
  const F4 gravity = {_mm_set_ps(0, inertia.gravity[2], inertia.gravity[1], inertia.gravity[0])};
  const F4 half = F4::All(0.5f * inertia.inertia), inverse_h = F4::All(1.0f / inertia.h);
  double sum = 0;
  const auto gather = [&](std::uint32_t n, float* known) {
    StoreQuad(PatchGradient(organ, at.place, n), known);
    const std::size_t i = 4 * static_cast<std::size_t>(n);
    const F4 here = F4::Load(at.place + i);
    F4 edges = F4::All(0);
    for (std::uint32_t k = organ.patch_start[n]; k < organ.patch_start[n + 1]; ++k) {
      const F4 d = here - F4::Load(at.place + 4 * static_cast<std::size_t>(organ.patch[k]));
      edges = edges + d * d * F4::All(organ.patch_gradient[4 * static_cast<std::size_t>(k) + 3]);
    }
    // Each edge is met from both ends.
    sum += 0.25 * static_cast<double>(DotProduct(edges, F4::All(1.0f)));
    if (at.start[i + 3] > 0.0f) {
      const F4 moved = here - F4::Load(at.start + i);
      const F4 momentum = moved * half - F4::Load(at.velocity + i) * inverse_h - gravity;
      sum +=
          static_cast<double>(organ.mass[n] * DotProduct(moved, momentum) - DotProduct(moved, F4::Load(at.load + i)));
    }
  };
  ForGroups(first, last, gather, [&](Group& group) {
    const Matrix3<F> f = LoadColumns3<kKnown, F>(group.known);
    const F j = Dot(f.c0, Cross(f.c1, f.c2)) - F::All(1.0f);
    const F density = F::All(0.5f * organ.mu * (1.0f - organ.variance)) * (Dot(f, f) - F::All(3.0f)) -
                      F::All(organ.mu) * j + F::All(0.5f * organ.lambda) * (j * j);
    alignas(64) float of_patch[kPatchLanes];
    (density * F::Load(organ.volume + group.first)).Store(of_patch);
    for (std::uint32_t i = 0; i < group.count; ++i) {
      sum += static_cast<double>(of_patch[i]);
    }
  });
  return sum;
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
