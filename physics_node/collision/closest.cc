// Reference of the kernels in touch_impl.h, which lists the equations.
#include "physics_node/collision/closest.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/kernels.h"

namespace fulcrum::physics {
namespace {

/// Quotient of a projection onto an edge; 0 for an edge without length.
float Ratio(float numerator, float denominator) { return denominator > 0.0f ? numerator / denominator : 0.0f; }

/// Four lanes: the three edges of a triangle at once; the fourth repeats the first.
using F4 = float __attribute__((vector_size(16)));

F4 Clamp01(F4 v) {
  const F4 zero{}, one = zero + 1.0f;
  v = v < zero ? zero : v;
  return v > one ? one : v;
}
/// Lanes where the denominator is not positive give 0.
F4 Ratio(F4 numerator, F4 denominator) {
  const F4 zero{}, one = zero + 1.0f;
  return denominator > zero ? numerator / (denominator > zero ? denominator : one) : zero;
}

struct EdgesClosest {
  F4 s, t;  ///< Along the segment, along the edge.
  F4 distance_sq;
};

/// Closest parameters of the segment p0 + s u and each edge corner[i] + t (corner[i+1] - corner[i]) (Ericson 5.1.9).
EdgesClosest ClosestEdges(const Vec3f& p0, const Vec3f& u, const Vec3f& x0, const Vec3f& x1, const Vec3f& x2) {
  const auto lanes = [&](int axis) { return F4{x0[axis], x1[axis], x2[axis], x0[axis]}; };
  const auto next = [&](int axis) { return F4{x1[axis], x2[axis], x0[axis], x1[axis]}; };
  const F4 px = lanes(0), py = lanes(1), pz = lanes(2);
  const F4 vx = next(0) - px, vy = next(1) - py, vz = next(2) - pz;
  const F4 rx = p0.x() - px, ry = p0.y() - py, rz = p0.z() - pz;
  const F4 zero{};
  const F4 a = zero + u.squaredNorm();
  const F4 e = vx * vx + vy * vy + vz * vz, f = vx * rx + vy * ry + vz * rz;
  const F4 c = u.x() * rx + u.y() * ry + u.z() * rz, b = u.x() * vx + u.y() * vy + u.z() * vz;
  const F4 denominator = a * e - b * b;
  // Parallel: any s will do.
  F4 s = denominator > kParallelSinSq * a * e ? Clamp01(Ratio(b * f - c * e, denominator)) : zero;
  F4 t = Ratio(b * s + f, e);
  const F4 inside = Clamp01(t);
  s = inside != t ? Clamp01(Ratio(inside * b - c, a)) : s;
  t = inside;
  const F4 dx = rx + s * u.x() - t * vx, dy = ry + s * u.y() - t * vy, dz = rz + s * u.z() - t * vz;
  return {s, t, dx * dx + dy * dy + dz * dz};
}

}  // namespace

std::array<float, 3> ClosestOnTriangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0f && d2 <= 0.0f) {
    return {1, 0, 0};
  }
  const Vec3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0f && d4 <= d3) {
    return {0, 1, 0};
  }
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) {
    const float v = Ratio(d1, d1 - d3);
    return {1 - v, v, 0};
  }
  const Vec3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0f && d5 <= d6) {
    return {0, 0, 1};
  }
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) {
    const float w = Ratio(d2, d2 - d6);
    return {1 - w, 0, w};
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0.0f && d4 - d3 >= 0.0f && d5 - d6 >= 0.0f) {
    const float w = Ratio(d4 - d3, (d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const float sum = va + vb + vc;
  const float v = Ratio(vb, sum), w = Ratio(vc, sum);
  return {1 - v - w, v, w};
}

ClosestPoints ClosestSegmentTriangle(const Vec3f& p0, const Vec3f& p1, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f u = p1 - p0;
  const Vec3f n = (b - a).cross(c - a);
  const float n2 = n.squaredNorm(), h0 = n.dot(p0 - a), h1 = n.dot(p1 - a);
  // Inside when the three sub-areas have the sign of the whole.
  const auto inside = [&](const Vec3f& p, std::array<float, 3>* bary) {
    const float wa = n.dot((b - p).cross(c - p)), wb = n.dot((c - p).cross(a - p)), wc = n2 - wa - wb;
    *bary = {wa / n2, wb / n2, wc / n2};
    return wa >= 0.0f && wb >= 0.0f && wc >= 0.0f;
  };
  std::array<float, 3> bary;
  if ((h0 > 0.0f) != (h1 > 0.0f) && h0 != h1 && n2 > 0.0f) {
    const float t = h0 / (h0 - h1);
    const Vec3f at = p0 + t * u;
    if (inside(at, &bary)) {
      return {0.0f, t, bary, at, at, true};
    }
  }
  // The segment against the edges, with corners and ends; then an end over the inside.
  const EdgesClosest edges = ClosestEdges(p0, u, a, b, c);
  std::size_t edge = edges.distance_sq[1] < edges.distance_sq[0] ? 1 : 0;
  edge = edges.distance_sq[2] < edges.distance_sq[edge] ? 2 : edge;
  ClosestPoints best;
  best.distance_sq = edges.distance_sq[edge];
  best.t = edges.s[edge];
  best.barycentric[edge] = 1.0f - edges.t[edge];
  best.barycentric[edge < 2 ? edge + 1 : 0] = edges.t[edge];
  for (const float t : {0.0f, 1.0f}) {
    const float h = t > 0.0f ? h1 : h0;
    if (h * h < best.distance_sq * n2 && inside(t > 0.0f ? p1 : p0, &bary)) {
      best.distance_sq = h * h / n2;
      best.t = t;
      best.barycentric = bary;
    }
  }
  best.on_segment = p0 + best.t * u;
  best.on_triangle = best.barycentric[0] * a + best.barycentric[1] * b + best.barycentric[2] * c;
  return best;
}

}  // namespace fulcrum::physics
