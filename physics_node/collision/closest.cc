#include "physics_node/collision/closest.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics {
namespace {

/// Quotient of a projection onto an edge, 0 for an edge of no length.
float Ratio(float numerator, float denominator) { return denominator > 0.0f ? numerator / denominator : 0.0f; }

/// Closest parameters (s, t) of the segments p0 + s u and q0 + t v (Ericson 5.1.9).
std::array<float, 2> ClosestSegments(const Vec3f& p0, const Vec3f& u, const Vec3f& q0, const Vec3f& v) {
  const Vec3f r = p0 - q0;
  const float a = u.squaredNorm(), e = v.squaredNorm(), f = v.dot(r), c = u.dot(r), b = u.dot(v);
  const float denominator = a * e - b * b;
  float s = 0.0f;
  // Parallel within rounding: any s will do.
  if (denominator > 1e-6f * a * e) {
    s = std::clamp((b * f - c * e) / denominator, 0.0f, 1.0f);
  }
  float t = Ratio(b * s + f, e);
  if (t < 0.0f || t > 1.0f) {
    t = std::clamp(t, 0.0f, 1.0f);
    s = std::clamp(Ratio(t * b - c, a), 0.0f, 1.0f);
  }
  return {s, t};
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
  const std::array<const Vec3f*, 3> corner{&a, &b, &c};
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
  // The segment against the edges, which covers corners and ends; then an end over the inside.
  ClosestPoints best;
  best.distance_sq = 3e38f;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = i < 2 ? i + 1 : 0;
    const Vec3f v = *corner[j] - *corner[i];
    const auto [s, t] = ClosestSegments(p0, u, *corner[i], v);
    const float distance_sq = (p0 + s * u - *corner[i] - t * v).squaredNorm();
    if (distance_sq < best.distance_sq) {
      best.distance_sq = distance_sq;
      best.t = s;
      best.barycentric = {0, 0, 0};
      best.barycentric[i] = 1.0f - t;
      best.barycentric[j] = t;
    }
  }
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
