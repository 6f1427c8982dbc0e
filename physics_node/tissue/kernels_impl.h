// Bodies of the kernels that move free particles; compiled for each instruction set.
//
// Prediction (Verlet), per coordinate:
//
//   x   <- x_p                                  where |x - x_p| >= l or x is not a number: damaged
//   s    = (x - x_p) keep + g dt^2
//   x_p <- x,   x <- x + s where w > 0
//
// Limit on the movement of a step, per particle, after the projections, with d = x - x_p:
//
//   x   <- x_p + d min(1, L / |d|)              x <- x_p where |d|^2 is not finite
//
//   x, x_p  position now and one (sub)step ago [m]       w       inverse mass [1/kg], 0 = fixed
//   keep    share of the velocity that damping leaves    g dt^2  fall in a (sub)step [m]
//   l       limit on a coordinate's change [m]           L       limit on the movement [m]
//
// Layout: planes of x, y, z and w with one particle per lane (Integrate, Finish), or xyzw with two particles per
// vector, lanes x y z w x y z w (IntegrateXyzw, FinishXyzw). No stencil: particles are independent.
#pragma once

#include "physics_node/simd/lanes.h"
#include "physics_node/tissue/kernels.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Of a mask over two xyzw particles: the lanes of x, y and z, and those of x alone, one for each particle.
inline constexpr std::uint32_t kXyzBits = 0x77u, kParticleBits = 0x11u;

std::uint32_t Integrate(float* const now[3], float* const previous[3], const float* w, std::size_t count,
                        const IntegrateSettings& settings) {
  std::uint32_t resets = 0;
  const F8 keep = F8::All(settings.keep);
  const F8 limit = F8::All(settings.limit);
  for (int axis = 0; axis < 3; ++axis) {
    const F8 fall = F8::All(settings.gravity[axis]);
    float* x = now[axis];
    float* p = previous[axis];
    for (std::size_t i = 0; i < count; i += kLanes) {
      const F8 last = F8::Load(p + i);
      F8 here = F8::Load(x + i);
      const F8 good = Abs(here - last) < limit;  // False for NaN.
      if (Bits(good) != kEveryLane) {
        here = Select(good, here, last);
        resets += static_cast<std::uint32_t>(__builtin_popcount(~Bits(good) & kEveryLane));
      }
      const F8 step = (here - last) * keep + fall;
      here.Store(p + i);
      (here + (step & (F8::Load(w + i) > F8::All(0.0f)))).Store(x + i);
    }
  }
  return resets;
}

inline float LargestLane(F8 v) {
  alignas(32) float lanes[kLanes];
  v.Store(lanes);
  float largest = lanes[0];
  for (const float lane : lanes) {
    largest = lane > largest ? lane : largest;
  }
  return largest;
}

FinishResult Finish(float* const now[3], const float* const previous[3], const float* w, std::size_t count,
                    float limit_sq) {
  FinishResult result{0, 0};
  F8 largest = F8::All(0.0f);
  const F8 limit = F8::All(limit_sq);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const V8 x{F8::Load(now[0] + i), F8::Load(now[1] + i), F8::Load(now[2] + i)};
    const V8 p{F8::Load(previous[0] + i), F8::Load(previous[1] + i), F8::Load(previous[2] + i)};
    const V8 d = x - p;
    const F8 moved = Dot(d, d);
    const F8 good = moved < limit;  // False for NaN.
    if (Bits(good) != kEveryLane) {
      const F8 finite = moved < F8::All(kLargestFinite);
      const F8 part = Sqrt(limit / Max(moved, limit)) & finite;
      const V8 kept = p + V8{d.x & finite, d.y & finite, d.z & finite} * part;
      Select(good, x.x, kept.x).Store(now[0] + i);
      Select(good, x.y, kept.y).Store(now[1] + i);
      Select(good, x.z, kept.z).Store(now[2] + i);
      const F8 free = F8::Load(w + i) > F8::All(0.0f);
      result.resets += static_cast<std::uint32_t>(__builtin_popcount(~Bits(good) & Bits(free) & kEveryLane));
    }
    largest = Max(moved & good, largest);
  }
  result.max_step_sq = LargestLane(largest);
  return result;
}

/// Mask of the lanes x, y and z of two xyzw particles.
inline F8 XyzLanes() {
  alignas(32) static constexpr float kXyz[kLanes] = {1, 1, 1, 0, 1, 1, 1, 0};
  return F8::Load(kXyz) > F8::All(0.0f);
}

std::uint32_t IntegrateXyzw(float* now, float* previous, std::size_t count, const IntegrateSettings& settings) {
  std::uint32_t resets = 0;
  const float* g = settings.gravity;
  alignas(32) const float falls[kLanes] = {g[0], g[1], g[2], 0, g[0], g[1], g[2], 0};
  const F8 keep = F8::All(settings.keep), limit = F8::All(settings.limit), fall = F8::Load(falls), xyz = XyzLanes();
  for (std::size_t i = 0; i < count; i += kLanes) {
    const F8 last = F8::Load(previous + i), x = F8::Load(now + i);
    F8 here = x;
    const F8 good = Abs(here - last) < limit;  // False for NaN.
    if ((~Bits(good) & kXyzBits) != 0) {
      here = Select(good, here, last);
      resets += static_cast<std::uint32_t>(__builtin_popcount(~Bits(good) & kXyzBits));
    }
    const F8 step = (here - last) * keep + fall;
    Select(xyz, here, last).Store(previous + i);
    Select(xyz, here + (step & (Spread<3>(x) > F8::All(0.0f))), x).Store(now + i);
  }
  return resets;
}

FinishResult FinishXyzw(float* now, const float* previous, std::size_t count, float limit_sq) {
  FinishResult result{0, 0};
  const F8 limit = F8::All(limit_sq), xyz = XyzLanes();
  F8 largest = F8::All(0.0f);
  for (std::size_t i = 0; i < count; i += kLanes) {
    const F8 x = F8::Load(now + i), p = F8::Load(previous + i);
    const F8 d = x - p, squares = d * d;
    const F8 moved = Spread<0>(squares) + Spread<1>(squares) + Spread<2>(squares);
    const F8 good = moved < limit;  // False for NaN.
    if (Bits(good) != kEveryLane) {
      const F8 finite = moved < F8::All(kLargestFinite);
      const F8 part = Sqrt(limit / Max(moved, limit)) & finite;
      const F8 kept = p + (d & finite) * part;
      Select(xyz, Select(good, x, kept), x).Store(now + i);
      const F8 free = Spread<3>(x) > F8::All(0.0f);
      result.resets += static_cast<std::uint32_t>(__builtin_popcount(~Bits(good) & Bits(free) & kParticleBits));
    }
    largest = Max(moved & good, largest);
  }
  result.max_step_sq = LargestLane(largest);
  return result;
}

constexpr tissue::Kernels MakeKernels(const char* name) { return {name, Integrate, Finish, IntegrateXyzw, FinishXyzw}; }

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
