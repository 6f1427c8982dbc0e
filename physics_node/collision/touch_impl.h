// A moving segment against eight triangles, and eight points against one triangle each. Included only by bodies of
// kernels. Reference in the tests: physics_node/collision/closest.h.
//
// Closest points of segment p0 + s u, u = p1 - p0, and triangle x_0 x_1 x_2 with N = (x_1 - x_0) x (x_2 - x_0): the
// least distance of the following candidates.
//
//   edges    edge i is x_i + t v, v = x_(i+1) - x_i; with r = p0 - x_i and a = u.u, b = u.v, c = u.r, e = v.v, f = v.r:
//            s = clamp01((b f - c e) / (a e - b^2)),   t = (b s + f) / e
//            where t is outside [0, 1]:  t = clamp01(t),  s = clamp01((t b - c) / a)          (Ericson 2005, 5.1.9)
//            where a e - b^2 <= kParallelSinSq a e, parallel:  s = 0
//   ends     p0, p1 over the inside:  |N . (p - x_0)| / |N|   where all w_i >= 0
//   crossing N.(p0 - x_0) and N.(p1 - x_0) of opposite sign, all w_i >= 0 at s = h0 / (h0 - h1):  distance 0
//   w_0 = N . (x_1 - p) x (x_2 - p),  w_1 = N . (x_2 - p) x (x_0 - p),  w_2 = N.N - w_0 - w_1;   barycentric: w_i / N.N
//
// First touch by conservative advancement (Mirtich 1996): no point of the segment covers more than travel * du, so
//
//   u <- min(u1, u + max((distance(u) - reach) / travel, least))   until distance(u) <= reach or u = u1
//
//   N, N.N   normal [m^2] and its square [m^4]      h0, h1  N.(p - x_0) at the two ends [m^3]
//   u        part of the step's motion, in [0, 1]   reach, travel [m], least: TouchSearch
//
// Closest point of a triangle abc to a point p (Feet): the Voronoi regions of Ericson 2005, 5.1.5, evaluated in reverse
// order, so that a later Select overrides an earlier one; with ab = b - a, ac = c - a:
//
//   d1 = ab.(p-a)  d2 = ac.(p-a)  d3 = ab.(p-b)  d4 = ac.(p-b)  d5 = ab.(p-c)  d6 = ac.(p-c) [m^2]
//   va = d3 d6 - d5 d4,  vb = d5 d2 - d1 d6,  vc = d1 d4 - d3 d2 [m^4];   foot = a + v ab + w ac
//   inside: (v, w) = (vb, vc) / (va + vb + vc)      edge bc: w = (d4 - d3) / ((d4 - d3) + (d5 - d6)), v = 1 - w
//   edge ca: v = 0, w = d2 / (d2 - d6)              edge ab: v = d1 / (d1 - d3), w = 0              corners: 0 or 1
//
// Layout: one triangle per lane (TriangleBatch, PointBatch); the segment is the same in all lanes.
#pragma once

#include "physics_node/collision/kernels.h"
#include "physics_node/simd/lanes.h"

namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE {

/// Mask: true in all lanes.
inline F8 Everywhere() { return F8::All(0.0f) < F8::All(1.0f); }
inline F8 Either(F8 mask, F8 other) { return Select(mask, mask, other); }
/// `otherwise`, but 0 (as a mask: false) where `mask` is true.
inline F8 Unless(F8 mask, F8 otherwise) { return Select(mask, F8::All(0.0f), otherwise); }
inline F8 Clamp01(F8 v) { return Min(Max(v, F8::All(0.0f)), F8::All(1.0f)); }
/// 0 where the denominator is not positive.
inline F8 Ratio(F8 numerator, F8 denominator) {
  const F8 positive = denominator > F8::All(0.0f);
  return (numerator / Select(positive, denominator, F8::All(1.0f))) & positive;
}

/// A triangle with N.N below this, or equal to it, is treated as its three edges: 1 / N.N must not overflow [m^4].
inline constexpr float kLeastAreaSq = 1e-30f;

/// Triangle per lane.
struct Triangles8 {
  V8 x[3];        ///< Corners [m].
  V8 normal;      ///< N, not of unit length [m^2].
  F8 area_sq;     ///< N.N [m^4].
  V8 edge[3];     ///< From corner i to corner i + 1 [m].
  F8 edge_sq[3];  ///< Squared lengths [m^2].
};

/// TouchBatch in registers.
struct Touch8 {
  F8 u, distance_sq, t, weight[3], crosses;
  void TakeWhere(F8 mask, const Touch8& other) {
    u = Select(mask, other.u, u);
    distance_sq = Select(mask, other.distance_sq, distance_sq);
    t = Select(mask, other.t, t);
    for (int i = 0; i < 3; ++i) {
      weight[i] = Select(mask, other.weight[i], weight[i]);
    }
    crosses = Select(mask, other.crosses, crosses);
  }
};

/// Barycentric coordinates of the foot of p in the plane. Mask: the foot is inside the triangle.
FULCRUM_INLINE F8 Inside(const Triangles8& tri, V8 p, F8 inverse_area_sq, F8* weight) {
  const V8 a = tri.x[0] - p, b = tri.x[1] - p, c = tri.x[2] - p;
  const F8 wa = Dot(tri.normal, Cross(b, c)), wb = Dot(tri.normal, Cross(c, a)), wc = tri.area_sq - wa - wb;
  weight[0] = wa * inverse_area_sq;
  weight[1] = wb * inverse_area_sq;
  weight[2] = wc * inverse_area_sq;
  const F8 negative = Min(wa, Min(wb, wc)) < F8::All(0.0f);
  return Unless(negative, Everywhere());
}

/// Closest points of the segment and edge `i`: positions s on the segment and t on the edge.
struct Edge8 {
  F8 distance_sq, s, t;
};
FULCRUM_INLINE Edge8 ClosestOfEdge(const Triangles8& tri, int i, V8 p0, V8 along, F8 length_sq) {
  const V8 r = p0 - tri.x[i], v = tri.edge[i];
  const F8 e = tri.edge_sq[i], f = Dot(v, r), c = Dot(along, r), b = Dot(along, v);
  const F8 denominator = length_sq * e - b * b;
  const F8 skew = denominator > F8::All(kParallelSinSq) * length_sq * e;
  F8 s = Clamp01(Ratio(b * f - c * e, denominator)) & skew;
  const F8 t = Ratio(b * s + f, e), inside = Clamp01(t);
  const F8 clamped = Either(inside < t, t < inside);
  s = Select(clamped, Clamp01(Ratio(inside * b - c, length_sq)), s);
  const V8 d = r + along * s - v * inside;
  return {Dot(d, d), s, inside};
}

FULCRUM_INLINE Touch8 ClosestOfSegment(const Triangles8& tri, V8 p0, V8 p1) {
  const F8 zero = F8::All(0.0f), one = F8::All(1.0f);
  const V8 along = p1 - p0;
  const F8 h0 = Dot(tri.normal, p0 - tri.x[0]), h1 = Dot(tri.normal, p1 - tri.x[0]);
  const F8 flat = tri.area_sq > F8::All(kLeastAreaSq);
  const F8 inverse_area_sq = (one / Select(flat, tri.area_sq, one)) & flat;

  // Edges, with the corners of the triangle and the ends of the segment.
  const F8 length_sq = Dot(along, along);
  Edge8 best = ClosestOfEdge(tri, 0, p0, along, length_sq);
  Touch8 touch;
  touch.weight[0] = one - best.t;
  touch.weight[1] = best.t;
  touch.weight[2] = zero;
  for (int i = 1; i < 3; ++i) {
    const Edge8 edge = ClosestOfEdge(tri, i, p0, along, length_sq);
    const F8 nearer = edge.distance_sq < best.distance_sq;
    best = {Select(nearer, edge.distance_sq, best.distance_sq), Select(nearer, edge.s, best.s), zero};
    touch.weight[i] = Select(nearer, one - edge.t, touch.weight[i]);
    touch.weight[(i + 1) % 3] = Select(nearer, edge.t, touch.weight[(i + 1) % 3]);
    touch.weight[(i + 2) % 3] = Select(nearer, zero, touch.weight[(i + 2) % 3]);
  }
  touch.distance_sq = best.distance_sq;
  touch.t = best.s;
  touch.crosses = zero;

  // An end over the inside.
  for (int end = 0; end < 2; ++end) {
    const F8 h = end == 0 ? h0 : h1;
    F8 weight[3];
    const F8 over =
        Inside(tri, end == 0 ? p0 : p1, inverse_area_sq, weight) & flat & (h * h < touch.distance_sq * tri.area_sq);
    touch.distance_sq = Select(over, h * h * inverse_area_sq, touch.distance_sq);
    touch.t = Select(over, F8::All(static_cast<float>(end)), touch.t);
    for (int i = 0; i < 3; ++i) {
      touch.weight[i] = Select(over, weight[i], touch.weight[i]);
    }
  }

  // Crossing.
  const F8 through = ((h0 > zero) ^ (h1 > zero)) & flat;
  if (Bits(through) != 0) {
    const F8 t = h0 / Select(through, h0 - h1, one);
    F8 weight[3];
    const F8 hit = Inside(tri, p0 + along * t, inverse_area_sq, weight) & through;
    touch.distance_sq = Unless(hit, touch.distance_sq);
    touch.t = Select(hit, t, touch.t);
    touch.crosses = one & hit;
    for (int i = 0; i < 3; ++i) {
      touch.weight[i] = Select(hit, weight[i], touch.weight[i]);
    }
  }
  return touch;
}

inline V8 AllOf(const float* p) { return {F8::All(p[0]), F8::All(p[1]), F8::All(p[2])}; }

void FirstTouch(const SegmentMotion& segment, const TouchSearch& search, const TriangleBatch& triangles,
                TouchBatch* out) {
  const F8 zero = F8::All(0.0f), far = F8::All(kLargestFinite);
  const V8 a = AllOf(segment.from[0]), b = AllOf(segment.from[1]);
  const V8 da = AllOf(segment.to[0]) - a, db = AllOf(segment.to[1]) - b;
  Triangles8 tri;
  for (int i = 0; i < 3; ++i) {
    tri.x[i] = {F8::Load(triangles.corner[i][0]), F8::Load(triangles.corner[i][1]), F8::Load(triangles.corner[i][2])};
  }
  // Bounding spheres of the triangles around their centroids: skip the far ones.
  const F8 third = F8::All(1.0f / 3.0f);
  const V8 centre = (tri.x[0] + tri.x[1] + tri.x[2]) * third;
  F8 radius_sq = zero;
  for (const V8& x : tri.x) {
    const V8 d = x - centre;
    radius_sq = Max(radius_sq, Dot(d, d));
  }
  const F8 radius = Sqrt(radius_sq);
  const auto to_centre = [&](F8 u, F8* t) {
    const V8 p = a + da * u, along = b + db * u - p;
    *t = Clamp01(Ratio(Dot(centre - p, along), Dot(along, along)));
    const V8 d = p + along * *t - centre;
    return Dot(d, d);
  };
  F8 t;
  const F8 middle_sq = to_centre(F8::All(0.5f * (search.u0 + search.u1)), &t);
  const F8 limit = F8::All(search.range) + radius, exact = F8::All(search.exact) + radius;
  const F8 is_far = middle_sq > limit * limit, is_rough = middle_sq > exact * exact;

  Touch8 best;
  best.u = F8::All(search.u1);
  best.distance_sq = far;
  best.t = best.crosses = zero;
  best.weight[0] = best.weight[1] = best.weight[2] = third;
  if (Bits(Unless(is_far, is_rough)) != 0) {
    const F8 middle_at_end = to_centre(F8::All(search.u1), &t);
    best.distance_sq = Select(Unless(is_far, is_rough), middle_at_end, far);
    best.t = t;
  }
  F8 done = Either(is_far, is_rough);
  if (Bits(done) != kEveryLane) {
    for (int i = 0; i < 3; ++i) {
      tri.edge[i] = tri.x[(i + 1) % 3] - tri.x[i];
      tri.edge_sq[i] = Dot(tri.edge[i], tri.edge[i]);
    }
    tri.normal = Cross(tri.edge[0], tri.x[2] - tri.x[0]);
    tri.area_sq = Dot(tri.normal, tri.normal);
    const F8 reach = F8::All(search.reach), end = F8::All(search.u1);
    F8 u = search.travel > 0.0f ? F8::All(search.u0) : end;
    for (;;) {
      Touch8 sample = ClosestOfSegment(tri, a + da * u, b + db * u);
      sample.u = u;
      best.TakeWhere(Unless(done, sample.distance_sq < best.distance_sq), sample);
      done = Either(done, Unless((u < end) & (sample.distance_sq > reach * reach), Everywhere()));
      if (Bits(done) == kEveryLane) {
        break;
      }
      const F8 advance = (Sqrt(sample.distance_sq) - reach) / F8::All(search.travel);
      u = Min(end, u + Max(advance, F8::All(search.least)));
    }
  }
  best.u.Store(out->u);
  best.distance_sq.Store(out->distance_sq);
  best.t.Store(out->t);
  for (int i = 0; i < 3; ++i) {
    best.weight[i].Store(out->weight[i]);
  }
  best.crosses.Store(out->crosses);
}

void Feet(const float* particles, const PointBatch& points, FootBatch* out) {
  const F8 zero = F8::All(0.0f), one = F8::All(1.0f);
  const V8 p{F8::Load(points.point[0]), F8::Load(points.point[1]), F8::Load(points.point[2])};
  const V8 a = GatherXyzw<F8>(particles, points.corner[0], 0).p;
  const V8 b = GatherXyzw<F8>(particles, points.corner[1], 0).p;
  const V8 c = GatherXyzw<F8>(particles, points.corner[2], 0).p;
  const V8 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const F8 d1 = Dot(ab, ap), d2 = Dot(ac, ap), d3 = Dot(ab, bp), d4 = Dot(ac, bp), d5 = Dot(ab, cp), d6 = Dot(ac, cp);
  const F8 va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  const auto not_above = [&](F8 x, F8 limit) { return Unless(x > limit, Everywhere()); };

  const F8 sum = va + vb + vc;
  F8 v = Ratio(vb, sum), w = Ratio(vc, sum);
  const F8 to_c = d4 - d3, to_b = d5 - d6;
  const F8 on_bc = not_above(va, zero) & not_above(zero, to_c) & not_above(zero, to_b);
  const F8 along_bc = Ratio(to_c, to_c + to_b);
  v = Select(on_bc, one - along_bc, v);
  w = Select(on_bc, along_bc, w);
  const F8 on_ca = not_above(vb, zero) & not_above(zero, d2) & not_above(d6, zero);
  v = Unless(on_ca, v);
  w = Select(on_ca, Ratio(d2, d2 - d6), w);
  const F8 at_c = not_above(zero, d6) & not_above(d5, d6);
  v = Unless(at_c, v);
  w = Select(at_c, one, w);
  const F8 on_ab = not_above(vc, zero) & not_above(zero, d1) & not_above(d3, zero);
  v = Select(on_ab, Ratio(d1, d1 - d3), v);
  w = Unless(on_ab, w);
  const F8 at_b = not_above(zero, d3) & not_above(d4, d3);
  v = Select(at_b, one, v);
  w = Unless(at_b, w);
  const F8 at_a = not_above(d1, zero) & not_above(d2, zero);
  v = Unless(at_a, v);
  w = Unless(at_a, w);

  const V8 offset = ap - ab * v - ac * w;
  (one - v - w).Store(out->weight[0]);
  v.Store(out->weight[1]);
  w.Store(out->weight[2]);
  Dot(offset, offset).Store(out->distance_sq);
  Dot(Cross(ab, ac), offset).Store(out->side);
}

}  // namespace fulcrum::physics::FULCRUM_KERNEL_NAMESPACE
