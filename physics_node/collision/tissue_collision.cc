#include "physics_node/collision/tissue_collision.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "physics_node/collision/closest.h"
#include "services/base/core/breathing.h"

namespace fulcrum::physics {
namespace {

/// Rows are made this far from contact, and half as much again as the particle moves in a step [m].
constexpr float kBand = 0.0002f;
constexpr float Band(float way) { return kBand + 1.5f * way; }
/// A particle that is near goes so far before its nearest triangle is looked for anew [m].
constexpr float kKeep = 0.0003f;
/// What is further than this behind a surface has gone through for good [m].
constexpr float kMaxBehind = 0.005f;
/// A particle is followed against the triangle it is nearest to. Other parts of the surface may come nearer by as much
/// as they move otherwise than that triangle: of how far the surface moves anywhere, this part.
constexpr float kElsewhere = 0.25f;
/// Fixed surfaces are seen from this far [m].
constexpr float kSight = 0.012f;
constexpr float kAnywhere = 10.0f;
/// Beside a rim: the offset from the nearest point lies less than this much along the normal.
constexpr float kBesideCosine = 0.5f;
/// Nearer than this the triangle's own normal is the better direction [m].
constexpr float kTouching = 0.0003f;
/// Steps of a walk over the organ's surface in one look.
constexpr int kMaxWalk = 8;
/// What is known of watches is fetched so many ahead: a core's cache does not hold all.
constexpr std::size_t kAhead = 8;

}  // namespace

TissueCollision::TissueCollision(const SceneView& scene, const TissueModel* model, const ParticleStore* particles,
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
  // Behind an edge the way out is still that of the triangle.
  result.normal = front && distance > kTouching ? Vec3f(offset / distance) : normal;
  return result;
}

void TissueCollision::Watch::SetGap(float from_contact, const Vec3f& where, float others_travel) {
  gap = from_contact;
  near = blocks && gap < Band(way) + kKeep;
  others = others_travel;
  gone = 0.0f;
  seen = last = where;
}

std::array<Vec3f, 3> TissueCollision::OrganCorners(Index triangle) const {
  const Triangle& v = scene_.tube_surface[triangle];
  return {particles_->At({4 * v[0], 1}), particles_->At({4 * v[1], 1}), particles_->At({4 * v[2], 1})};
}

bool TissueCollision::breath_near() const {
  return std::any_of(fixed_.begin(), fixed_.end(), [this](const Fixed& fixed) {
    const auto touches = [&](const Near& near) { return Touches(fixed.watches.all[near.watch].particle); };
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

std::size_t TissueCollision::looked_at() const {
  std::size_t count = 0;
  ForFound([&](const Found& part) { count += part.looked_at; });
  return count;
}

void TissueCollision::Walk(Watch* watch, const Vec3f& p) const {
  PointBatch points;
  FootBatch feet;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::fill_n(points.point[axis], kLanes, p[static_cast<int>(axis)]);
  }
  const float* tube = particles_->raw().data();
  float best = 3e38f;
  for (int step = 0; step < kMaxWalk; ++step) {
    const Index from = watch->triangle;
    // The triangle itself first; a batch is filled up with its last one.
    const Index first = step == 0 ? ring_start_[from] : ring_start_[from] + 1, last = ring_start_[from + 1];
    for (Index i = first; i < last; i += kLanes) {
      for (Index lane = 0; lane < kLanes; ++lane) {
        const Triangle& v = scene_.tube_surface[ring_[std::min(i + lane, last - 1)]];
        for (std::size_t corner = 0; corner < 3; ++corner) {
          points.corner[corner][lane] = 4 * v[corner];
        }
      }
      kernels_.feet(tube, points, &feet);
      for (Index lane = 0; lane < std::min<Index>(kLanes, last - i); ++lane) {
        if (feet.distance_sq[lane] < best) {
          best = feet.distance_sq[lane];
          watch->triangle = ring_[i + lane];
        }
      }
    }
    if (watch->triangle == from) {
      return;
    }
  }
}

template <class Stand>
void TissueCollision::AskWay(Watch* watch, float others_moved, float unknown, const Stand& stand) const {
  if (watch->asked == step_) {
    return;
  }
  const Vec3f at = stand(*watch);
  const bool known = watch->asked + 1 == step_;
  watch->way = known ? (at - watch->last).norm() + (watch->near ? 0.0f : kElsewhere * others_moved) : unknown;
  watch->gone = (at - watch->seen).norm();
  watch->last = at;
  watch->asked = step_;
}

/// Groups in which a watch may have to be asked, in order.
template <class Around>
auto TissueCollision::FindDue(Watches* watches, int part, std::span<const float> moved, const Around& around,
                              std::vector<Due>* found) -> std::span<Due> {
  const auto bound = [&](int p) { return watches->groups.size() * static_cast<std::size_t>(p) / kParts; };
  const std::size_t begin = bound(part), end = bound(part + 1);
  found->resize(std::max(found->size(), end - begin));
  std::size_t count = 0;
  for (std::size_t i = begin; i < end; ++i) {
    Group& group = watches->groups[i];
    const float step = moved[group.block] + around(i), travel = group.travel += step;
    // A row may come of what gets into its band in the first half of this step.
    const float from = travel + step + Band(step);
    const bool is_due = travel >= group.times.due;
    (*found)[count] = {.group = static_cast<Index>(i), .step = step, .travel = travel, .from = from, .is_due = is_due};
    count += is_due || group.times.start < from ? 1 : 0;
  }
  return {found->data(), count};
}

/// Watches of `due` for which wanted(due, group's times or its own) holds.
template <class Wanted>
void TissueCollision::FindAsked(const Watches& watches, std::span<const Due> due, const Wanted& wanted,
                                std::vector<Asked>* asked) {
  asked->clear();
  for (std::size_t k = 0; k < due.size(); ++k) {
    const Index ahead = due[std::min(k + kAhead, due.size() - 1)].group;
    __builtin_prefetch(&watches.times[watches.first[ahead]]);
    __builtin_prefetch(&watches.times[watches.first[ahead + 1] - 1]);
    if (wanted(due[k], watches.groups[due[k].group].times)) {
      for (Index i = watches.first[due[k].group]; i < watches.first[due[k].group + 1]; ++i) {
        if (wanted(due[k], watches.times[i])) {
          asked->push_back({i, static_cast<Index>(k)});
        }
      }
    }
  }
}

/// body(watch, asked) for each, with what it takes to say where it stands fetched ahead.
template <class Body>
void TissueCollision::ForAsked(Watches* watches, std::span<const Asked> asked, const Body& body) const {
  const bool of_organ = watches == &organ_;
  const float* pool = particles_->raw().data();
  for (std::size_t k = 0; k < asked.size() + kAhead; ++k) {
    if (k < asked.size()) {
      __builtin_prefetch(&watches->all[asked[k].watch]);
    }
    if (const std::size_t next = k - kAhead / 2; k >= kAhead / 2 && next < asked.size()) {
      const Watch& watch = watches->all[asked[next].watch];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        __builtin_prefetch(pool + watch.at.base + axis * watch.at.step);
      }
      if (of_organ) {
        __builtin_prefetch(&scene_.tube_surface[watch.triangle]);
      }
    }
    if (k >= kAhead) {
      body(&watches->all[asked[k - kAhead].watch], asked[k - kAhead]);
    }
  }
}

/// look(watch) tells how far the particle is from contact. stand(watch) is where it is, as far as that concerns what
/// it watches.
template <class Around, class Stand, class Look>
void TissueCollision::LookAtDue(Watches* watches, int part, std::span<const float> moved, float others_travel,
                                float others_moved, const Around& around, const Stand& stand, const Look& look) {
  Found& found = watches->found[static_cast<std::size_t>(part)];
  found.near.clear();
  found.looked_at = 0;
  const std::span<Due> groups = FindDue(watches, part, moved, around, &found.due);
  FindAsked(
      *watches, groups, [](const Due& due, const Times& times) { return due.is_due && due.travel >= times.due; },
      &found.asked);
  ForAsked(watches, found.asked, [&](Watch* watch, const Asked& asked) {
    Due& due = groups[asked.due];
    AskWay(watch, others_moved, due.step, stand);
    float others = watch->near ? 0.0f : kElsewhere * (others_travel - watch->others);
    const float left = watch->near ? kKeep - watch->gone : watch->gap - watch->gone - others - Band(watch->way);
    if (!(left > 0.0f)) {
      ++found.looked_at;
      const Index before = watch->triangle;
      watch->SetGap(look(watch), stand(*watch), others_travel);
      others = 0.0f;
      due.strayed |= watch->triangle != before;
    }
    // Asked again a step before the block's fastest could have come there: then its own way is known.
    const float alone = watch->gap - watch->gone - others - Band(due.step) - due.step;
    const float far = watch->gap < kNever ? kSight : kNever;
    watches->times[asked.watch] = {
        due.travel + (watch->near ? kKeep - watch->gone : std::max(0.0f, std::min(alone, far))),
        watch->near ? due.travel - watch->gone + watch->gap : kNever};
  });
  for (const Due& due : groups) {
    if (due.is_due) {
      Times& least = watches->groups[due.group].times = {kNever, kNever};
      for (Index i = watches->first[due.group]; i < watches->first[due.group + 1]; ++i) {
        const Times& times = watches->times[i];
        least = {std::min(least.due, times.due), std::min(least.start, times.start)};
      }
      if (watches == &organ_ && due.strayed) {
        FindBeside(due.group);
      }
    }
  }
  FindAsked(
      *watches, groups, [](const Due& due, const Times& times) { return times.start < due.from; }, &found.asked);
  ForAsked(watches, found.asked, [&](Watch* watch, const Asked& asked) {
    AskWay(watch, others_moved, groups[asked.due].step, stand);
    if (watch->gap - watch->gone - watch->way < Band(watch->way)) {
      found.near.push_back({asked.watch, Band(watch->way)});
    }
  });
}

void TissueCollision::FindBeside(Index group) {
  const Index any = particles_->tube_blocks();
  Beside& beside = organ_.beside[group];
  std::size_t count = 0;
  for (Index i = organ_.first[group]; i < organ_.first[group + 1]; ++i) {
    for (const Index vertex : scene_.tube_surface[organ_.all[i].triangle]) {
      const Index block = particles_->BlockOf(vertex);
      const auto end = beside.begin() + static_cast<std::ptrdiff_t>(count);
      if (std::find(beside.begin(), end, block) != end) {
        continue;
      }
      if (count == kMostBeside) {
        beside.fill(any);
        return;
      }
      beside[count++] = block;
    }
  }
  std::fill(beside.begin() + static_cast<std::ptrdiff_t>(count), beside.end(), beside[count - 1]);
}

void TissueCollision::LookAtFixed(Fixed* fixed, int part, std::span<const float> moved) {
  const Vec3f shift = fixed->breathes ? breath0_ : Vec3f(Vec3f::Zero());
  const TriangleTree& tree = fixed->tree;
  const float breathed = fixed->breathes ? (breath1_ - breath0_).norm() : 0.0f;
  LookAtDue(
      &fixed->watches, part, moved, fixed->breathes ? breath_travel_ : 0.0f, breathed,
      [&](std::size_t) { return breathed; },
      [&](const Watch& watch) { return Vec3f(particles_->At(watch.at) - shift); },
      [&](Watch* watch) { return See(tree, particles_->At(watch->at) - shift, watch); });
}

/// How far a particle at p is from contact with a fixed surface.
float TissueCollision::See(const TriangleTree& tree, const Vec3f& p, Watch* watch) const {
  const TriangleTree::Hit hit = tree.Nearest(p, kSight, watch->triangle);
  if (hit.triangle == kNoIndex) {
    watch->front = watch->blocks = false;
    return kSight;
  }
  watch->triangle = hit.triangle;
  if (!std::exchange(watch->judged, true)) {
    const Vec3f& rest = scene_.rest_position[watch->particle];
    const TriangleTree::Hit at_rest = tree.Nearest(rest, kAnywhere, hit.triangle);
    const float height = tree.normal(at_rest.triangle).dot(rest - at_rest.point);
    watch->behind = height < 0.0f;
    watch->clearance = std::min(scene_.physics.collision_margin_m, 0.5f * height);
  }
  if (watch->behind) {
    watch->blocks = false;
    return kNever;
  }
  watch->point = hit.point;
  watch->normal = tree.normal(hit.triangle);
  const float distance = std::sqrt(hit.distance_sq), height = watch->normal.dot(p - hit.point);
  const bool beside = distance > kTouching && std::abs(height) < kBesideCosine * distance;
  // What goes round a rim has not come through: from beneath, nothing throws it back up.
  watch->front = !beside && (watch->front || height > 0.0f);
  watch->blocks = watch->front && !beside && height > -kMaxBehind;
  // Past a rim or behind, it comes to contact only round the rim.
  return watch->blocks ? height - watch->clearance : std::max(distance, 2.0f * kKeep);
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

void TissueCollision::LookAtOrgan(int part, std::span<const float> moved) {
  LookAtDue(
      &organ_, part, moved, organ_travel_, organ_moved_,
      [&](std::size_t group) {
        const Beside& beside = organ_.beside[group];
        const auto larger = [&](std::size_t i, std::size_t j) {
          return std::max(organ_moved_of_[beside[i]], organ_moved_of_[beside[j]]);
        };
        return std::max(std::max(larger(0, 1), larger(2, 3)), std::max(larger(4, 5), larger(6, 7))) +
               kElsewhere * organ_moved_;
      },
      [&](const Watch& watch) { return Standpoint(watch); },
      [&](Watch* watch) {
        const Vec3f p = particles_->At(watch->at);
        Walk(watch, p);
        return SignedDistance(p, OrganCorners(watch->triangle)).distance - watch->clearance;
      });
}

void TissueCollision::FindPairsOf(int task, std::span<const float> moved) {
  const int surfaces = tasks() / kParts, surface = task % surfaces, part = task / surfaces;
  if (surface == 0) {
    LookAtOrgan(part, moved);
  } else {
    LookAtFixed(&fixed_[static_cast<std::size_t>(surface) - 1], part, moved);
  }
}

/// Dead and loose membrane touches nothing.
bool TissueCollision::Touches(Index particle) const {
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
    if (watch.normal.dot(particles_->At(watch.at)) > row.offset + (u1 - u0) * near.band || !Touches(watch.particle)) {
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
  row.source = kSource | near.watch;
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
      if (feet.distance_sq[lane] > reach * reach || !Touches(watch.particle)) {
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
