#include "physics_node/collision/tissue_collision.h"

#include <algorithm>
#include <cmath>

#include "physics_node/collision/closest.h"
#include "services/core/breathing.h"

namespace fulcrum::physics {
namespace {

/// Rows are made this far from contact, and as much more as the block moves in two steps [m].
constexpr float kBand = 0.0002f;
/// A particle that is near goes so far before its nearest triangle is looked for anew [m].
constexpr float kKeep = 0.0003f;
/// What is further than this behind a surface has gone through for good [m].
constexpr float kMaxBehind = 0.005f;
/// Fixed surfaces are seen from this far [m].
constexpr float kSight = 0.012f;
constexpr float kAnywhere = 10.0f;
/// Beside a rim: the offset from the nearest point lies less than this much along the normal.
constexpr float kBesideCosine = 0.5f;
/// Nearer than this the triangle's own normal is the better direction [m].
constexpr float kTouching = 0.0003f;
/// Steps of a walk over the organ's surface in one look.
constexpr int kMaxWalk = 8;

}  // namespace

TissueCollision::TissueCollision(const SceneView& scene, const TissueModel* model, const ParticleStore* particles)
    : scene_(scene), model_(model), particles_(particles) {
  travel_.assign((particles->particle_count() + kBlock - 1) / kBlock, 0.0f);
  WatchOrgan();
  for (const StaticSurface& surface : scene.static_surfaces) {
    if (surface.collides) {
      WatchFixed(surface);
    }
  }
  near_organ_.reserve(organ_.size());
}

TissueCollision::Signed TissueCollision::SignedDistance(const Vec3f& p, const std::array<Vec3f, 3>& corners) {
  Signed result;
  result.barycentric = ClosestOnTriangle(p, corners[0], corners[1], corners[2]);
  const auto& b = result.barycentric;
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
  // Behind an edge the way out is still that of the triangle.
  result.normal = front && distance > kTouching ? Vec3f(offset / distance) : normal;
  return result;
}

void TissueCollision::MakeGroups(std::span<Watch> watches, std::vector<Group>* groups) {
  for (Index i = 0; i < watches.size(); ++i) {
    const Index block = watches[i].particle / kBlock;
    if (groups->empty() || groups->back().block != block) {
      groups->push_back({block, i, i, 0.0f, 0});
    }
    groups->back().last = i + 1;
  }
}

std::array<Vec3f, 3> TissueCollision::OrganCorners(Index triangle) const {
  const Triangle& v = scene_.tube_surface[triangle];
  return {particles_->At({4 * v[0], 1}), particles_->At({4 * v[1], 1}), particles_->At({4 * v[2], 1})};
}

void TissueCollision::WatchOrgan() {
  std::vector<std::array<Vec3f, 3>> corners;
  std::vector<std::vector<Index>> around(scene_.tube_vertex_count);
  for (Index t = 0; t < scene_.tube_surface.size(); ++t) {
    const Triangle& v = scene_.tube_surface[t];
    corners.push_back({scene_.rest_position[v[0]], scene_.rest_position[v[1]], scene_.rest_position[v[2]]});
    for (const Index vertex : v) {
      around[vertex].push_back(t);
    }
  }
  ring_start_.push_back(0);
  for (Index t = 0; t < scene_.tube_surface.size(); ++t) {
    std::vector<Index> ring;
    for (const Index vertex : scene_.tube_surface[t]) {
      ring.insert(ring.end(), around[vertex].begin(), around[vertex].end());
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
    std::erase(ring, t);
    ring_.insert(ring_.end(), ring.begin(), ring.end());
    ring_start_.push_back(static_cast<Index>(ring_.size()));
  }
  const TriangleTree tree(corners);
  for (Index node = 0; node < scene_.membrane.node_count() && !tree.empty(); ++node) {
    const Index particle = scene_.membrane.first + node;
    const Vec3f& p = scene_.rest_position[particle];
    const TriangleTree::Hit hit = tree.Nearest(p, 1.0f);
    if (scene_.inverse_mass[particle] > 0.0f && hit.triangle != kNoIndex) {
      const float rest = SignedDistance(p, corners[hit.triangle]).distance;
      if (rest > 0.0f) {
        const float clearance = std::min(scene_.physics.collision_margin_m, 0.5f * rest);
        Watch watch;
        watch.particle = particle;
        watch.at = particles_->Ref(particle);
        watch.triangle = hit.triangle;
        watch.clearance = clearance;
        organ_.push_back(watch);
      }
    }
  }
  MakeGroups(organ_, &organ_groups_);
}

void TissueCollision::WatchFixed(const StaticSurface& surface) {
  std::vector<std::array<Vec3f, 3>> corners;
  for (Index t = surface.first_triangle; t < surface.first_triangle + surface.triangle_count; ++t) {
    const Triangle& v = scene_.static_triangles[t];
    corners.push_back({scene_.static_vertices[v[0]], scene_.static_vertices[v[1]], scene_.static_vertices[v[2]]});
  }
  Fixed fixed;
  fixed.tree = TriangleTree(std::move(corners));
  fixed.breathes = scene_.breathing.amplitude_m > 0.0f && Breathes(surface.role);
  std::vector<bool> on_surface(particles_->particle_count(), false);
  for (const Triangle& t : scene_.tube_surface) {
    on_surface[t[0]] = on_surface[t[1]] = on_surface[t[2]] = true;
  }
  for (Index particle = 0; particle < particles_->particle_count(); ++particle) {
    if (!(scene_.inverse_mass[particle] > 0.0f) || (particle < scene_.tube_vertex_count && !on_surface[particle])) {
      continue;
    }
    const Vec3f& p = scene_.rest_position[particle];
    const TriangleTree::Hit hit = fixed.tree.Nearest(p, kAnywhere);
    if (hit.triangle == kNoIndex) {
      continue;
    }
    const float height = fixed.tree.normal(hit.triangle).dot(p - hit.point);
    if (height < 0.0f) {
      continue;
    }
    Watch watch;
    watch.particle = particle;
    watch.at = particles_->Ref(particle);
    watch.clearance = std::min(scene_.physics.collision_margin_m, 0.5f * height);
    fixed.watches.push_back(watch);
  }
  MakeGroups(fixed.watches, &fixed.groups);
  fixed.near.reserve(fixed.watches.size());
  fixed_.push_back(std::move(fixed));
}

bool TissueCollision::breath_near() const {
  return std::any_of(fixed_.begin(), fixed_.end(), [this](const Fixed& fixed) {
    return fixed.breathes && std::any_of(fixed.near.begin(), fixed.near.end(),
                                         [&](const Near& near) { return Touches(fixed.watches[near.watch].particle); });
  });
}

std::size_t TissueCollision::near_count() const {
  std::size_t count = near_organ_.size();
  for (const Fixed& fixed : fixed_) {
    count += fixed.near.size();
  }
  return count;
}

void TissueCollision::MeasureMoves(std::vector<float>* moved) const {
  moved->assign(block_count(), 0.0f);
  for (Index p = 0; p < particles_->particle_count(); ++p) {
    const ParticleRef at = particles_->Ref(p);
    float& largest = (*moved)[p / kBlock];
    largest = std::max(largest, (particles_->At(at) - particles_->Previous(at)).squaredNorm());
  }
  for (float& m : *moved) {
    m = std::sqrt(m);
  }
}

void TissueCollision::Walk(Watch* watch, const Vec3f& p) const {
  const auto distance_sq = [&](Index t) {
    const auto x = OrganCorners(t);
    const auto b = ClosestOnTriangle(p, x[0], x[1], x[2]);
    return (p - b[0] * x[0] - b[1] * x[1] - b[2] * x[2]).squaredNorm();
  };
  float best = distance_sq(watch->triangle);
  for (int step = 0; step < kMaxWalk; ++step) {
    const Index from = watch->triangle;
    for (Index i = ring_start_[from]; i < ring_start_[from + 1]; ++i) {
      const float d = distance_sq(ring_[i]);
      if (d < best) {
        best = d;
        watch->triangle = ring_[i];
      }
    }
    if (watch->triangle == from) {
      return;
    }
  }
}

/// look(watch, reach) tells how far the particle is from contact, 3e38 where there can be none; `reach` is from where
/// on it is near.
template <class Look>
void TissueCollision::LookAtDue(std::vector<Group>* groups, std::vector<Watch>* watches, std::span<const float> moved,
                                float others_travel, float others_moved, std::vector<Near>* near, const Look& look) {
  near->clear();
  for (Group& group : *groups) {
    const float travel = travel_[group.block] + others_travel;
    const float band = kBand + 2.0f * (moved[group.block] + others_moved), reach = band + kKeep;
    if (travel >= group.due) {
      group.due = 3e38f;
      group.near = 0;
      for (Index i = group.first; i < group.last; ++i) {
        Watch& watch = (*watches)[i];
        if (travel >= watch.due) {
          ++looked_at_;
          const float distance = look(&watch);
          watch.near = watch.blocks && distance < reach;
          watch.due = travel + (watch.near ? kKeep : std::min(distance, kSight) - band);
        }
        group.near += watch.near;
        group.due = std::min(group.due, watch.due);
      }
    }
    for (Index i = group.near > 0 ? group.first : group.last; i < group.last; ++i) {
      if ((*watches)[i].near) {
        near->push_back({i, band});
      }
    }
  }
}

void TissueCollision::LookAtFixed(Fixed* fixed, std::span<const float> moved) {
  const Vec3f shift = fixed->breathes ? breath0_ : Vec3f(Vec3f::Zero());
  const TriangleTree& tree = fixed->tree;
  const float breathed = fixed->breathes ? (breath1_ - breath0_).norm() : 0.0f;
  LookAtDue(&fixed->groups, &fixed->watches, moved, fixed->breathes ? breath_travel_ : 0.0f, breathed, &fixed->near,
            [&](Watch* watch) {
              const Vec3f p = particles_->At(watch->at) - shift;
              const TriangleTree::Hit hit = tree.Nearest(p, kSight);
              if (hit.triangle == kNoIndex) {
                watch->front = watch->blocks = false;
                return kSight;
              }
              watch->point = hit.point;
              watch->normal = tree.normal(hit.triangle);
              const float distance = std::sqrt(hit.distance_sq), height = watch->normal.dot(p - hit.point);
              const bool beside = std::abs(height) < kBesideCosine * distance;
              watch->front = watch->front || (height > 0.0f && !beside);
              watch->blocks = watch->front && !beside && height > -kMaxBehind;
              // Past a rim or behind, it comes to contact only round the rim.
              return watch->blocks ? height - watch->clearance : std::max(distance, 2.0f * kKeep);
            });
}

void TissueCollision::FindPairs(std::span<const float> moved, double time0_s, double time1_s) {
  looked_at_ = 0;
  const Index organ_blocks = (scene_.tube_vertex_count + kBlock - 1) / kBlock;
  float organ_moved = 0;
  for (Index b = 0; b < travel_.size(); ++b) {
    travel_[b] += moved[b];
    organ_moved = b < organ_blocks ? std::max(organ_moved, moved[b]) : organ_moved;
  }
  organ_travel_ += organ_moved;
  breath0_ = BreathingOffset(scene_.breathing, time0_s);
  breath1_ = BreathingOffset(scene_.breathing, time1_s);
  breath_travel_ += (breath1_ - breath0_).norm();
  LookAtDue(&organ_groups_, &organ_, moved, organ_travel_, organ_moved, &near_organ_, [&](Watch* watch) {
    const Vec3f p = particles_->At(watch->at);
    Walk(watch, p);
    return SignedDistance(p, OrganCorners(watch->triangle)).distance - watch->clearance;
  });
  for (Fixed& fixed : fixed_) {
    LookAtFixed(&fixed, moved);
  }
}

/// Dead and loose membrane touches nothing.
bool TissueCollision::Touches(Index particle) const {
  const Index first = scene_.membrane.first;
  return particle < first || (model_->NodeAlive(particle - first) && !model_->IsDebris(particle - first));
}

void TissueCollision::AddFixedRows(const Fixed& fixed, float u0, float u1, std::size_t limit,
                                   std::vector<ContactRow>* rows) const {
  ContactRow row;
  row.friction = scene_.physics.friction;
  row.count = 1;
  row.weight[0] = 1.0f;
  const Vec3f shift = fixed.breathes ? Vec3f(breath0_ + u1 * (breath1_ - breath0_)) : Vec3f(Vec3f::Zero());
  row.drift = fixed.breathes ? Vec3f((u1 - u0) * (breath1_ - breath0_)) : Vec3f(Vec3f::Zero());
  for (const Near& near : fixed.near) {
    const Watch& watch = fixed.watches[near.watch];
    row.offset = watch.normal.dot(watch.point + shift) + watch.clearance;
    if (watch.normal.dot(particles_->At(watch.at)) > row.offset + near.band || !Touches(watch.particle)) {
      continue;
    }
    if (rows->size() == limit) {
      return;
    }
    row.at[0] = watch.at;
    row.normal = watch.normal;
    row.source = kSource | near.watch;
    rows->push_back(row);
  }
}

void TissueCollision::Rows(float u0, float u1, std::vector<ContactRow>* rows) const {
  const std::size_t limit = rows->size() + kMaxRows;
  ContactRow row;
  row.friction = scene_.physics.friction;
  for (const Near& near : near_organ_) {
    const Watch& watch = organ_[near.watch];
    const Signed now = SignedDistance(particles_->At(watch.at), OrganCorners(watch.triangle));
    if (now.distance > watch.clearance + near.band || now.distance < -kMaxBehind || !Touches(watch.particle)) {
      continue;
    }
    if (rows->size() == limit) {
      return;
    }
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
    row.source = kSource | near.watch;
    rows->push_back(row);
  }
  for (const Fixed& fixed : fixed_) {
    AddFixedRows(fixed, u0, u1, limit, rows);
  }
}

}  // namespace fulcrum::physics
