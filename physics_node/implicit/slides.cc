#include "physics_node/implicit/slides.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics_node/collision/closest.h"
#include "physics_node/implicit/kernels.h"

namespace fulcrum::physics::implicit {
namespace {

constexpr std::uint32_t kFloats = kVertexFloats;  ///< Of a vertex in a field.
/// Rings of triangles that a nearest point crosses in one substep at most.
constexpr int kMostRings = 8;
/// Nearer than this the direction to a point on a rim is rounding, and the normal of the triangle replaces it [m].
constexpr float kTouching_m = 1e-5f;
/// Two triangles with a common nearest point have the same distance to about this part of its square.
constexpr float kSameDistance = 1e-5f;

}  // namespace

Slides::Slides(const ElasticModel& model, const ParticleStore& particles) : triangles_(model.slide_surface) {
  for (const ElasticSlide& slide : model.slides) {
    slides_.push_back({particles.Ref(slide.vertex), static_cast<float>(slide.gap_m),
                       static_cast<float>(slide.stiffness), slide.triangle, slide.triangle,
                       slide.normal.cast<float>()});
    Element& e = elements_.emplace_back();
    e.at[0] = slides_.back().vertex;
    e.weight[0] = 1.0f;
    for (std::size_t k = 0; k < 3; ++k) e.at[k + 1] = particles.Ref(triangles_[slide.triangle][k]);
  }
  force_.assign(slides_.size(), 0.0f);
  normal_.assign(slides_.size(), Vec3f::Zero());
  turned_.assign(slides_.size(), 0.0f);
  acts_.reserve(slides_.size());
  product_.reserve(slides_.size());
  Index vertices = 0;
  for (const Triangle& t : triangles_) vertices = std::max({vertices, t[0] + 1, t[1] + 1, t[2] + 1});
  std::vector<std::vector<Index>> at(vertices);
  for (Index t = 0; t < triangles_.size(); ++t) {
    for (const Index v : triangles_[t]) at[v].push_back(t);
  }
  for (Index t = 0; t < triangles_.size(); ++t) {
    ring_start_.push_back(static_cast<Index>(ring_.size()));
    std::vector<Index> around;
    for (const Index v : triangles_[t]) around.insert(around.end(), at[v].begin(), at[v].end());
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    ring_.push_back(t);
    std::copy_if(around.begin(), around.end(), std::back_inserter(ring_), [t](Index other) { return other != t; });
  }
  ring_start_.push_back(static_cast<Index>(ring_.size()));
}

void Slides::Restart() {
  for (Slide& slide : slides_) slide.triangle = kNoIndex;
}

std::array<Vec3f, 3> Slides::Corners(const float* place, Index triangle) const {
  std::array<Vec3f, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = FieldAt(place, {kFloats * triangles_[triangle][k]});
  return corners;
}

Slides::Foot Slides::FootOf(const float* place, const Slide& slide) const {
  const Vec3f p = FieldAt(place, slide.vertex);
  const bool known = slide.triangle != kNoIndex;
  Foot foot;
  foot.triangle = known ? slide.triangle : slide.rest;
  float nearest_sq = std::numeric_limits<float>::max(), height = 0;
  Vec3f along = Vec3f::Zero();  // From the nearest point to p.
  // The distance falls from ring to ring, so that the walk ends.
  const int most_rings = known ? kMostRings : std::numeric_limits<int>::max();
  for (int ring = 0; ring < most_rings; ++ring) {
    const Index from = foot.triangle;
    // The triangle itself is evaluated in the first step only.
    for (Index i = ring_start_[from] + (ring > 0 ? 1 : 0); i < ring_start_[from + 1]; ++i) {
      const std::array<Vec3f, 3> x = Corners(place, ring_[i]);
      const std::array<float, 3> b = ClosestOnTriangle(p, x[0], x[1], x[2]);
      const Vec3f r = p - (b[0] * x[0] + b[1] * x[1] + b[2] * x[2]);
      const float distance_sq = r.squaredNorm(), same = kSameDistance * nearest_sq;
      if (!(distance_sq < nearest_sq + same)) continue;
      const Vec3f normal = (x[1] - x[0]).cross(x[2] - x[0]).normalized();
      const float h = normal.dot(r);
      // Of triangles with a common nearest point the one that p is farthest above or below tells the side.
      if (distance_sq < nearest_sq - same || std::abs(h) > std::abs(height)) {
        nearest_sq = std::min(nearest_sq, distance_sq);
        foot = {ring_[i], b, normal, h, b[0] > 0.0f && b[1] > 0.0f && b[2] > 0.0f};
        height = h;
        along = r;
      }
    }
    if (foot.triangle == from) break;
  }
  if (const float distance = along.norm(); !foot.is_inside && distance > kTouching_m) {
    foot.gap_m = std::copysign(distance, height);
    foot.normal = along / foot.gap_m;
  }
  return foot;
}

void Slides::Linearise(const float* place, const Regions& regions) {
  acts_.clear();
  for (std::uint32_t i = 0; i < slides_.size(); ++i) {
    Slide& slide = slides_[i];
    Element& e = elements_[i];
    const auto is_computed = [&](ParticleRef at) { return regions.computed(regions.partition().Of(at)); };
    if (!regions.all_computed() && std::none_of(e.at.begin(), e.at.end(), is_computed)) continue;
    acts_.push_back(i);
    const Foot foot = FootOf(place, slide);
    const float stretch = foot.gap_m - slide.gap_m;
    if (foot.normal.isZero(0.0f) || !std::isfinite(stretch)) {  // A particle that is reset at the end of the substep.
      force_[i] = e.kt = 0.0f;
      e.m.setZero();
      continue;
    }
    slide.triangle = foot.triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      e.at[k + 1] = {kFloats * triangles_[foot.triangle][k]};
      e.weight[k + 1] = -foot.barycentric[k];
    }
    const bool is_on_rim = !foot.is_inside && std::abs(foot.gap_m) > kTouching_m;
    e.kt = is_on_rim ? slide.stiffness * std::clamp(stretch / foot.gap_m, 0.0f, 1.0f) : 0.0f;
    e.m = std::sqrt(slide.stiffness - e.kt) * foot.normal;
    normal_[i] = foot.normal;
    const float along = foot.normal.dot(slide.rest_normal);
    turned_[i] = std::clamp(1.0f - along * along, 0.0f, 1.0f);
    force_[i] = -slide.stiffness * stretch;
  }
}

void Slides::AddForce(float* residual) const {
  for (const std::uint32_t i : acts_) Spread(elements_[i], force_[i] * normal_[i], residual);
}

double Slides::Multiply(const float* p) {
  double sum = 0;
  product_.clear();
  for (const std::uint32_t i : acts_) {
    const Element& e = elements_[i];
    const Vec3f d = Combine(e, p), force = e.kt * d + e.m * e.m.dot(d);
    sum += static_cast<double>(d.dot(force));
    product_.push_back(force);
  }
  return sum;
}

void Slides::AddProduct(float scale, float* out) const {
  for (std::size_t i = 0; i < acts_.size(); ++i) Spread(elements_[acts_[i]], scale * product_[i], out);
}

double Slides::Energy(const float* place) const {
  double sum = 0;
  for (const std::uint32_t i : acts_) {
    const Slide& slide = slides_[i];
    const float stretch = FootOf(place, slide).gap_m - slide.gap_m;
    sum += 0.5 * static_cast<double>(slide.stiffness * stretch * stretch);
  }
  return sum;
}

}  // namespace fulcrum::physics::implicit
