// Construction, entry points and rows; the distances are in tissue_gaps.cc, the setup in tissue_watches.cc.
//
// Row of a particle x with clearance m, against the point y nearest to it on a triangle, with unit normal n:
//
//   organ:          n . x - sum_i b_i n . x_i >= m        x_i, b_i  corners and barycentric coordinates of y
//   fixed surface:  n . x >= n . (y + s(u1)) + m          s         breathing offset at part u1 of the step [m]
//
// n is (x - y) / |x - y| in front of the surface and further than kTouching from it, else the normal of the triangle;
// of a fixed surface always the latter.
#include "physics_node/collision/tissue_collision.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/closest.h"
#include "services/base/core/breathing.h"

namespace fulcrum::physics {

TissueCollision::TissueCollision(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles,
                                 const collision::Kernels& kernels)
    : scene_(scene), model_(model), particles_(particles), kernels_(kernels) {
  WatchOrgan();
  for (const StaticSurface& surface : scene.static_surfaces) {
    if (surface.collides) {
      WatchFixed(surface);
    }
  }
}

TissueCollision::Signed TissueCollision::SignedDistance(const Vec3f& p, const std::array<Vec3f, 3>& corners) {
  return SignedDistance(p, corners, ClosestOnTriangle(p, corners[0], corners[1], corners[2]));
}

TissueCollision::Signed TissueCollision::SignedDistance(const Vec3f& p, const std::array<Vec3f, 3>& corners,
                                                        const std::array<float, 3>& b) {
  Signed result;
  result.barycentric = b;
  const Vec3f offset = p - b[0] * corners[0] - b[1] * corners[1] - b[2] * corners[2];
  Vec3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const float area = normal.norm();
  if (!(area > 0.0f)) {
    return result;
  }
  normal /= area;
  const float distance = offset.norm();
  const bool front = normal.dot(offset) >= 0.0f;
  result.distance = front ? distance : -distance;
  // Behind the surface the row acts along the triangle's normal, also where an edge is nearest.
  result.normal = front && distance > kTouching ? Vec3f(offset / distance) : normal;
  return result;
}

std::array<Vec3f, 3> TissueCollision::OrganCorners(Index triangle) const {
  const Triangle& v = scene_.tube_surface[triangle];
  return {particles_->At({4 * v[0], 1}), particles_->At({4 * v[1], 1}), particles_->At({4 * v[2], 1})};
}

bool TissueCollision::breath_near() const {
  return std::any_of(fixed_.begin(), fixed_.end(), [this](const Fixed& fixed) {
    const auto touches = [&](const Near& near) { return Collides(fixed.watches.all[near.watch].particle); };
    return fixed.breathes &&
           std::any_of(fixed.watches.found.begin(), fixed.watches.found.end(),
                       [&](const Found& part) { return std::any_of(part.near.begin(), part.near.end(), touches); });
  });
}

template <class Body>
void TissueCollision::ForFound(const Body& body) const {
  std::for_each(organ_.found.begin(), organ_.found.end(), body);
  for (const Fixed& fixed : fixed_) {
    std::for_each(fixed.watches.found.begin(), fixed.watches.found.end(), body);
  }
}

std::size_t TissueCollision::near_count() const {
  std::size_t count = 0;
  ForFound([&](const Found& part) { count += part.near.size(); });
  return count;
}

std::size_t TissueCollision::evaluated_count() const {
  std::size_t count = 0;
  ForFound([&](const Found& part) { count += part.evaluated; });
  return count;
}

void TissueCollision::BeginPairs(std::span<const float> moved, double time0_s, double time1_s) {
  ++step_;
  const Index organ_blocks = particles_->tube_blocks();
  organ_moved_ = 0;
  for (Index b = 0; b < organ_blocks; ++b) {
    organ_moved_ = std::max(organ_moved_, moved[b]);
    organ_moved_of_[b] = moved[b];
  }
  organ_moved_of_[organ_blocks] = organ_moved_;
  organ_travel_ += organ_moved_;
  breath0_ = BreathingOffset(scene_.breathing, time0_s);
  breath1_ = BreathingOffset(scene_.breathing, time1_s);
  breath_travel_ += (breath1_ - breath0_).norm();
}

void TissueCollision::FindPairsOf(int task, std::span<const float> moved) {
  const int surfaces = tasks() / kParts, surface = task % surfaces, part = task / surfaces;
  if (surface == 0) {
    EvaluateOrgan(part, moved);
  } else {
    EvaluateFixed(&fixed_[static_cast<std::size_t>(surface) - 1], part, moved);
  }
}

/// Dead membrane and debris do not collide.
bool TissueCollision::Collides(Index particle) const {
  const Index first = scene_.membrane.first;
  return particle < first || (model_->NodeAlive(particle - first) && !model_->IsDebris(particle - first));
}

void TissueCollision::FindFixedRows(const Fixed& fixed, Found* found, float u0, float u1) const {
  ContactRow row;
  row.friction = scene_.physics.friction;
  row.count = 1;
  row.weight[0] = 1.0f;
  const Vec3f shift = fixed.breathes ? Vec3f(breath0_ + u1 * (breath1_ - breath0_)) : Vec3f(Vec3f::Zero());
  row.drift = fixed.breathes ? Vec3f((u1 - u0) * (breath1_ - breath0_)) : Vec3f(Vec3f::Zero());
  for (const Near& near : found->near) {
    const Watch& watch = fixed.watches.all[near.watch];
    row.offset = watch.normal.dot(watch.point + shift) + watch.clearance;
    if (watch.normal.dot(particles_->At(watch.at)) > row.offset + (u1 - u0) * near.band || !Collides(watch.particle)) {
      continue;
    }
    row.at[0] = watch.at;
    row.normal = watch.normal;
    row.source = kSource | near.watch;
    found->rows.push_back(row);
  }
}

void TissueCollision::AddOrganRow(const Near& near, const Signed& now, std::vector<ContactRow>* rows) const {
  const Watch& watch = organ_.all[near.watch];
  ContactRow& row = rows->emplace_back();
  row.friction = scene_.physics.friction;
  row.count = 1;
  row.at[0] = watch.at;
  row.weight[0] = 1.0f;
  for (std::size_t i = 0; i < 3; ++i) {
    if (now.barycentric[i] > 0.0f) {
      row.at[static_cast<std::size_t>(row.count)] = {4 * scene_.tube_surface[watch.triangle][i], 1};
      row.weight[static_cast<std::size_t>(row.count)] = -now.barycentric[i];
      ++row.count;
    }
  }
  row.normal = now.normal;
  row.offset = watch.clearance;
  row.source = kSource | (watch.particle < scene_.membrane.first ? kSolidSource : 0u) | near.watch;
}

void TissueCollision::FindOrganRows(Found* found, float u0, float u1) const {
  const float* tube = particles_->raw().data();
  PointBatch points{};
  FootBatch feet;
  for (std::size_t first = 0; first < found->near.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, found->near.size() - first);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Watch& watch = organ_.all[found->near[first + lane].watch];
      const Vec3f p = particles_->At(watch.at);
      for (std::size_t i = 0; i < 3; ++i) {
        points.point[i][lane] = p[static_cast<int>(i)];
        points.corner[i][lane] = 4 * scene_.tube_surface[watch.triangle][i];
      }
    }
    kernels_.feet(tube, points, &feet);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const Near& near = found->near[first + lane];
      const Watch& watch = organ_.all[near.watch];
      const float reach = feet.side[lane] < 0.0f ? kMaxBehind : watch.clearance + (u1 - u0) * near.band;
      if (feet.distance_sq[lane] > reach * reach || !Collides(watch.particle)) {
        continue;
      }
      const Signed now = SignedDistance(particles_->At(watch.at), OrganCorners(watch.triangle),
                                        {feet.weight[0][lane], feet.weight[1][lane], feet.weight[2][lane]});
      AddOrganRow(near, now, &found->rows);
    }
  }
}

void TissueCollision::FindRows(int part, float u0, float u1) {
  const auto i = static_cast<std::size_t>(part);
  organ_.found[i].rows.clear();
  FindOrganRows(&organ_.found[i], u0, u1);
  for (Fixed& fixed : fixed_) {
    fixed.watches.found[i].rows.clear();
    FindFixedRows(fixed, &fixed.watches.found[i], u0, u1);
  }
}

void TissueCollision::JoinRows(std::vector<ContactRow>* rows) const {
  std::size_t room = kMaxRows;
  ForFound([&](const Found& part) {
    const std::size_t count = std::min(room, part.rows.size());
    rows->insert(rows->end(), part.rows.begin(), part.rows.begin() + static_cast<std::ptrdiff_t>(count));
    room -= count;
  });
}

}  // namespace fulcrum::physics
