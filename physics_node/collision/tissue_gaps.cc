// Distances of particles from the surfaces in front of which they must stay, evaluated when a bound allows contact.
//
//   slack = gap - |x - x_gap| - e (T - T_gap) - B(s),   B(s) = kBand + kBandPerPath s
//
//   gap      distance from contact when it was last evaluated, at x_gap and T_gap [m]
//   x        position relative to the surface (RelativePlace; fixed surfaces: less the breathing offset) [m]
//   T        travel of the surface: the movement of its fastest part, summed over the steps [m];   e = kSurfaceShare
//   s        path of the particle relative to the surface in a step [m]
//   B        band: rows are made within this distance of contact [m]
//
// The gap is evaluated again when slack <= 0. A particle is near while gap < B + kNearTravel; it keeps its triangle and
// is evaluated again after |x - x_gap| = kNearTravel. Per block of particles (Group) the earliest of these events is
// stored as a value of the group's travel, the movement of its fastest particle and of the surface near it, summed over
// the steps: a group whose travel is below it needs no access to its watches.
//
// Stencil of the organ: a triangle and those that share a corner with it (ring_), eight per call of the kernel `feet`.
#include <algorithm>
#include <cmath>
#include <utility>

#include "physics_node/collision/tissue_collision.h"

namespace fulcrum::physics {
namespace {

/// Band of a particle at rest, and what it grows by per path in a step [m], [1]: rows must exist before contact, and
/// the particle can be faster in this step than in the last one.
constexpr float kBand = 0.0002f, kBandPerPath = 1.5f;
constexpr float Band(float step_path) { return kBand + kBandPerPath * step_path; }
/// Displacement after which the nearest triangle of a near particle is searched anew [m]: a small part of an edge.
constexpr float kNearTravel = 0.0003f;
/// The displacement is measured against the nearest triangle. Other parts of the surface can approach by as much as
/// they move relative to that triangle, at most by this share of the largest movement of the surface. Assumed.
constexpr float kSurfaceShare = 0.25f;
/// Range of the search for the nearest triangle of a fixed surface [m].
constexpr float kSearchRange = 0.012f;
/// Search range that contains every scene [m].
constexpr float kUnlimitedRange = 10.0f;
/// Past a rim: the offset from the nearest point has less than this share along the normal.
constexpr float kRimCosine = 0.5f;
/// Least gap of a particle past a rim or behind the surface, in kNearTravel: it is not near, since it can reach contact
/// only around the rim.
constexpr float kLeastFarGap = 2.0f;
/// Most steps of a walk over the organ's surface in one evaluation.
constexpr int kMaxWalk = 8;
/// Watches are prefetched this many iterations ahead: all of them exceed the cache of a core.
constexpr std::size_t kPrefetchAhead = 8;

}  // namespace

void TissueCollision::Watch::SetGap(float distance, const Vec3f& place, float travel_of_surface) {
  gap = distance;
  near = blocks && gap < Band(step_path) + kNearTravel;
  surface_travel = travel_of_surface;
  displacement = 0.0f;
  gap_place = last_place = place;
}

void TissueCollision::Walk(Watch* watch, const Vec3f& p) const {
  PointBatch points;
  FootBatch feet;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::fill_n(points.point[axis], kLanes, p[static_cast<int>(axis)]);
  }
  const float* tube = particles_->raw().data();
  float best = kLargestFinite;
  for (int step = 0; step < kMaxWalk; ++step) {
    const Index from = watch->triangle;
    // The ring begins with the triangle itself, which is evaluated in the first step only. The last triangle of a ring
    // fills the unused lanes of its batch.
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

template <class Place>
void TissueCollision::UpdatePath(Watch* watch, float surface_moved, float fallback, const Place& place) const {
  if (watch->updated_step == step_) {
    return;
  }
  const Vec3f at = place(*watch);
  const bool known = watch->updated_step + 1 == step_;
  watch->step_path =
      known ? (at - watch->last_place).norm() + (watch->near ? 0.0f : kSurfaceShare * surface_moved) : fallback;
  watch->displacement = (at - watch->gap_place).norm();
  watch->last_place = at;
  watch->updated_step = step_;
}

/// Groups with watches that are due or can produce rows in this step, in order.
template <class SurfaceStep>
auto TissueCollision::FindDue(Watches* watches, int part, std::span<const float> moved, const SurfaceStep& surface_step,
                              std::vector<Due>* found) -> std::span<Due> {
  const auto bound = [&](int p) { return watches->groups.size() * static_cast<std::size_t>(p) / kParts; };
  const std::size_t begin = bound(part), end = bound(part + 1);
  found->resize(std::max(found->size(), end - begin));
  std::size_t count = 0;
  for (std::size_t i = begin; i < end; ++i) {
    Group& group = watches->groups[i];
    const float step = moved[group.block] + surface_step(i), travel = group.travel += step;
    // Rows of this step belong to particles that are within their band after a movement by `step`.
    const float limit = travel + step + Band(step);
    const bool is_due = travel >= group.times.due;
    (*found)[count] = {
        .group = static_cast<Index>(i), .step = step, .travel = travel, .start_limit = limit, .is_due = is_due};
    count += is_due || group.times.start < limit ? 1 : 0;
  }
  return {found->data(), count};
}

/// Watches of the groups in `due` for which condition(due, times) holds for the times of the group and their own.
template <class Condition>
void TissueCollision::Select(const Watches& watches, std::span<const Due> due, const Condition& condition,
                             std::vector<Selected>* selected) {
  selected->clear();
  for (std::size_t k = 0; k < due.size(); ++k) {
    const Index ahead = due[std::min(k + kPrefetchAhead, due.size() - 1)].group;
    __builtin_prefetch(&watches.times[watches.first[ahead]]);
    __builtin_prefetch(&watches.times[watches.first[ahead + 1] - 1]);
    if (condition(due[k], watches.groups[due[k].group].times)) {
      for (Index i = watches.first[due[k].group]; i < watches.first[due[k].group + 1]; ++i) {
        if (condition(due[k], watches.times[i])) {
          selected->push_back({i, static_cast<Index>(k)});
        }
      }
    }
  }
}

/// body(watch, selected) for each watch; the watch, its particle and its triangle are prefetched.
template <class Body>
void TissueCollision::ForSelected(Watches* watches, std::span<const Selected> selected, const Body& body) const {
  const bool of_organ = watches == &organ_;
  const float* pool = particles_->raw().data();
  for (std::size_t k = 0; k < selected.size() + kPrefetchAhead; ++k) {
    if (k < selected.size()) {
      __builtin_prefetch(&watches->all[selected[k].watch]);
    }
    if (const std::size_t next = k - kPrefetchAhead / 2; k >= kPrefetchAhead / 2 && next < selected.size()) {
      const Watch& watch = watches->all[selected[next].watch];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        __builtin_prefetch(pool + watch.at.base + axis * watch.at.step);
      }
      if (of_organ) {
        __builtin_prefetch(&scene_.tube_surface[watch.triangle]);
      }
    }
    if (k >= kPrefetchAhead) {
      body(&watches->all[selected[k - kPrefetchAhead].watch], selected[k - kPrefetchAhead]);
    }
  }
}

template <class SurfaceStep, class Place, class Evaluate>
void TissueCollision::EvaluateDue(Watches* watches, int part, std::span<const float> moved, float surface_travel,
                                  float surface_moved, const SurfaceStep& surface_step, const Place& place,
                                  const Evaluate& evaluate) {
  Found& found = watches->found[static_cast<std::size_t>(part)];
  found.near.clear();
  found.evaluated = 0;
  const std::span<Due> groups = FindDue(watches, part, moved, surface_step, &found.due);
  Select(
      *watches, groups, [](const Due& due, const Times& times) { return due.is_due && due.travel >= times.due; },
      &found.selected);
  ForSelected(watches, found.selected, [&](Watch* watch, const Selected& selected) {
    Due& due = groups[selected.due];
    UpdatePath(watch, surface_moved, due.step, place);
    float approach = watch->near ? 0.0f : kSurfaceShare * (surface_travel - watch->surface_travel);
    const float slack = watch->near ? kNearTravel - watch->displacement
                                    : watch->gap - watch->displacement - approach - Band(watch->step_path);
    if (!(slack > 0.0f)) {
      ++found.evaluated;
      const Index before = watch->triangle;
      watch->SetGap(evaluate(watch), place(*watch), surface_travel);
      approach = 0.0f;
      due.changed_triangle |= watch->triangle != before;
    }
    // Due again a step before the fastest particle of the block could be in contact, so that step_path is known then;
    // and after kSearchRange at the latest, because no larger gap is measured.
    const float until_due = watch->gap - watch->displacement - approach - Band(due.step) - due.step;
    const float longest = watch->gap < kNever ? kSearchRange : kNever;
    watches->times[selected.watch] = {
        due.travel + (watch->near ? kNearTravel - watch->displacement : std::max(0.0f, std::min(until_due, longest))),
        watch->near ? due.travel - watch->displacement + watch->gap : kNever};
  });
  for (const Due& due : groups) {
    if (due.is_due) {
      Times& least = watches->groups[due.group].times = {kNever, kNever};
      for (Index i = watches->first[due.group]; i < watches->first[due.group + 1]; ++i) {
        const Times& times = watches->times[i];
        least = {std::min(least.due, times.due), std::min(least.start, times.start)};
      }
      if (watches == &organ_ && due.changed_triangle) {
        FindOrganBlocks(due.group);
      }
    }
  }
  Select(
      *watches, groups, [](const Due& due, const Times& times) { return times.start < due.start_limit; },
      &found.selected);
  ForSelected(watches, found.selected, [&](Watch* watch, const Selected& selected) {
    UpdatePath(watch, surface_moved, groups[selected.due].step, place);
    if (watch->gap - watch->displacement - watch->step_path < Band(watch->step_path)) {
      found.near.push_back({selected.watch, Band(watch->step_path)});
    }
  });
}

void TissueCollision::FindOrganBlocks(Index group) {
  const Index all_blocks = particles_->tube_blocks();  // Index of the largest movement in organ_moved_of_.
  OrganBlocks& blocks = organ_.organ_blocks[group];
  std::size_t count = 0;
  for (Index i = organ_.first[group]; i < organ_.first[group + 1]; ++i) {
    for (const Index vertex : scene_.tube_surface[organ_.all[i].triangle]) {
      const Index block = particles_->BlockOf(vertex);
      const auto end = blocks.begin() + static_cast<std::ptrdiff_t>(count);
      if (std::find(blocks.begin(), end, block) != end) {
        continue;
      }
      if (count == kMaxOrganBlocks) {
        blocks.fill(all_blocks);
        return;
      }
      blocks[count++] = block;
    }
  }
  std::fill(blocks.begin() + static_cast<std::ptrdiff_t>(count), blocks.end(), blocks[count - 1]);
}

void TissueCollision::EvaluateFixed(Fixed* fixed, int part, std::span<const float> moved) {
  const Vec3f shift = fixed->breathes ? breath0_ : Vec3f(Vec3f::Zero());
  const TriangleTree& tree = fixed->tree;
  const float breathed = fixed->breathes ? (breath1_ - breath0_).norm() : 0.0f;
  EvaluateDue(
      &fixed->watches, part, moved, fixed->breathes ? breath_travel_ : 0.0f, breathed,
      [&](std::size_t) { return breathed; },
      [&](const Watch& watch) { return Vec3f(particles_->At(watch.at) - shift); },
      [&](Watch* watch) { return EvaluateFixedGap(tree, particles_->At(watch->at) - shift, watch); });
}

float TissueCollision::EvaluateFixedGap(const TriangleTree& tree, const Vec3f& p, Watch* watch) const {
  const TriangleTree::Hit hit = tree.Nearest(p, kSearchRange, watch->triangle);
  if (hit.triangle == kNoIndex) {
    watch->front = watch->blocks = false;
    return kSearchRange;
  }
  watch->triangle = hit.triangle;
  if (!std::exchange(watch->side_known, true)) {
    const Vec3f& rest = scene_.rest_position[watch->particle];
    const TriangleTree::Hit at_rest = tree.Nearest(rest, kUnlimitedRange, hit.triangle);
    const float height = tree.normal(at_rest.triangle).dot(rest - at_rest.point);
    watch->behind = height < 0.0f;
    watch->clearance = std::min(scene_.physics.collision_margin_m, kRestShare * height);
  }
  if (watch->behind) {
    watch->blocks = false;
    return kNever;
  }
  watch->point = hit.point;
  watch->normal = tree.normal(hit.triangle);
  const float distance = std::sqrt(hit.distance_sq), height = watch->normal.dot(p - hit.point);
  const bool past_rim = distance > kTouching && std::abs(height) < kRimCosine * distance;
  // A particle that moves around a rim to the back has not passed through the surface; no row may push it to the front.
  watch->front = !past_rim && (watch->front || height > 0.0f);
  watch->blocks = watch->front && !past_rim && height > -kMaxBehind;
  return watch->blocks ? height - watch->clearance : std::max(distance, kLeastFarGap * kNearTravel);
}

void TissueCollision::EvaluateOrgan(int part, std::span<const float> moved) {
  EvaluateDue(
      &organ_, part, moved, organ_travel_, organ_moved_,
      [&](std::size_t group) {
        const OrganBlocks& blocks = organ_.organ_blocks[group];
        const auto larger = [&](std::size_t i, std::size_t j) {
          return std::max(organ_moved_of_[blocks[i]], organ_moved_of_[blocks[j]]);
        };
        return std::max(std::max(larger(0, 1), larger(2, 3)), std::max(larger(4, 5), larger(6, 7))) +
               kSurfaceShare * organ_moved_;
      },
      [&](const Watch& watch) { return RelativePlace(watch); },
      [&](Watch* watch) {
        const Vec3f p = particles_->At(watch->at);
        Walk(watch, p);
        return SignedDistance(p, OrganCorners(watch->triangle)).distance - watch->clearance;
      });
}

}  // namespace fulcrum::physics
