// Pairs of capsules and triangles of a step, their sides, and the correction of a pair.
//
//   a pair    distance of the triangle from the axis <= r + m + kSlack + min(tissue_step, kMaxReach) + travel
//   push      where the axis crosses the triangle:       depth = r + m - min s n . (x - y),  direction -s n
//             where s n . o < -kSideCosine |o|, behind:  depth = r + m + |o|,                direction -s n
//             else                                       depth = r + m - |o|,                direction -o / |o|
//
//   r, m      radius of the capsule and ContactMargin of the sheet [m]
//   y, o      closest point of the triangle; closest point of the axis minus y [m]
//   n, s      normal of the membrane around the triangle, or of the organ's triangle; side of the tool, +1 or -1
//   x         the two ends of the axis [m]
//   travel    path of the faster end in the step [m]
#include "physics_node/collision/tool_collision.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/sheet_heat.h"
#include "services/base/core/sheets.h"

namespace fulcrum::physics {
namespace {

/// Movement of tissue during the iterations of a step after which it is still among the pairs [m].
constexpr float kSlack = 0.0015f;
/// Rows are made for tissue this near to touch, plus its movement in a substep, of which at most kMaxReach counts [m].
constexpr float kRowBand = 0.001f;
constexpr float kMaxReach = 0.005f;
/// Distance from touch up to which the closest points of a new pair are exact; beyond, the centroid is used [m].
constexpr float kNear = 0.001f;
/// Deeper behind a triangle than this a tool has passed through the tissue, and a push would only tear it [m].
constexpr float kMaxBehindTool = 0.004f;
/// Steps without tissue in the way after which jaws that closed or released tissue collide again.
constexpr int kClearSteps = 5;
/// Jaws that closed without a hold are clear of tissue further from their axis than this share of their radius.
constexpr float kClearShare = 0.5f;
/// Sides refer to the normal of a patch of this many nodes in each direction instead of that of a triangle: a triangle
/// of crumpled membrane can turn over while the membrane does not.
constexpr Index kPatchNodes = 3;
/// Below this the kernel's distance and the difference of its two points are rounded too differently for their quotient
/// to be a unit vector [m].
constexpr float kRoundedDistance = 1e-5f;
/// The side of a tool is determined only if its offset has at least this share along the normal, not beside an edge.
constexpr float kSideCosine = 0.7f;
/// Squared distances from here on mark triangles that the kernel skipped (kLargestFinite) [m^2].
constexpr float kSkippedSq = 1e38f;
/// Pairs of a step for which memory is reserved: a tool among crumpled membrane.
constexpr std::size_t kPairCapacity = 2048;

SegmentMotion SegmentOf(const Capsule& from, const Capsule& to) {
  return {{{from.a.x(), from.a.y(), from.a.z()}, {from.b.x(), from.b.y(), from.b.z()}},
          {{to.a.x(), to.a.y(), to.a.z()}, {to.b.x(), to.b.y(), to.b.z()}}};
}

bool InOrder(const ContactPair& p, const ContactPair& q) {
  return std::pair(p.capsule, p.triangle) < std::pair(q.capsule, q.triangle);
}

}  // namespace

ToolCollision::ToolCollision(const TissueScene& scene, const TissueModel* model, ParticleStore* particles,
                             const collision::Kernels& kernels)
    : scene_(scene),
      model_(model),
      particles_(particles),
      kernels_(kernels),
      membrane_triangles_(scene.membrane.triangle_count()),
      sheet_of_(SheetOfRows(scene)),
      thickness_(ThicknessOfRows(scene)),
      thickest_m_(scene.thermal.thickness_m),
      bounds_(scene, model, particles, kernels) {
  for (std::uint32_t col = 0; col < scene.membrane.cols; ++col) {
    column_.push_back(particles->NodeRef(0, col));
  }
  const auto usual = [&](float thickness) { return thickness == scene.thermal.thickness_m; };
  if (std::all_of(thickness_.begin(), thickness_.end(), usual)) thickness_.clear();
  for (const float thickness : thickness_) thickest_m_ = std::max(thickest_m_, thickness);
  pairs_.reserve(kPairCapacity);
  last_pairs_.reserve(kPairCapacity);
  row_order_.reserve(kPairCapacity);
}

float ToolCollision::MarginAt(Index triangle, ToolPart part) const {
  if (thickness_.empty() || triangle >= membrane_triangles_) return ContactMargin(scene_, part);
  return ContactMargin(scene_, part, thickness_[triangle / 2 / (scene_.membrane.cols - 1)]);
}

Vec3f ToolCollision::PatchNormal(Index cell, bool previous) const {
  const GridLayout& layout = particles_->layout();
  const Index row = cell / (layout.cols - 1), col = cell % (layout.cols - 1);
  // Up to the rim of the sheet.
  const auto exists = [&](Index direction, Index r, Index c) {
    return scene_.membrane_rest_length[3 * (r * layout.cols + c) + direction] > 0.0f;
  };
  Index left = col, right = col + 1, top = row, bottom = row + 1;
  while (left > 0 && left + kPatchNodes > col && exists(0, row, left - 1)) --left;
  while (right < col + kPatchNodes + 1 && exists(0, row, right)) ++right;
  while (top > 0 && top + kPatchNodes > row && exists(1, top - 1, col)) --top;
  while (bottom < row + kPatchNodes + 1 && exists(1, bottom, col)) ++bottom;
  // None beside a cut: the tissue beyond it moves independently, and flaps can turn over.
  const auto whole = [&](int direction, Index r, Index c) {
    return model_->rest(direction)[column_[c].base - column_[0].base + r * layout.stride] > 0.0f;
  };
  for (Index c = left; c < right; ++c) {
    if (!whole(0, row, c)) {
      return Vec3f::Zero();
    }
  }
  for (Index r = top; r < bottom; ++r) {
    if (!whole(1, r, col)) {
      return Vec3f::Zero();
    }
  }
  const auto at = [&](Index r, Index c) {
    const ParticleRef ref{column_[c].base + r * layout.stride, column_[c].step};
    return previous ? particles_->Previous(ref) : particles_->At(ref);
  };
  const Vec3f along = at(row, right) - at(row, left), down = at(bottom, col) - at(top, col);
  const Vec3f normal = along.cross(down);
  const float area = normal.norm();
  return area > 0.0f ? Vec3f(normal / area) : Vec3f(Vec3f::Zero());
}

bool ToolCollision::IsFar(const std::array<Vec3f, 3>& x, const Capsule& capsule, float range) {
  const Vec3f centre = (x[0] + x[1] + x[2]) / 3.0f;
  const float radius = std::sqrt(
      std::max((x[0] - centre).squaredNorm(), std::max((x[1] - centre).squaredNorm(), (x[2] - centre).squaredNorm())));
  return DistanceSqToSegment(centre, capsule.a, capsule.b) > (range + radius) * (range + radius);
}

void ToolCollision::LoadTriangle(const std::array<ParticleRef, 3>& at, std::size_t lane) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3f x = particles_->At(at[i]);
    for (int axis = 0; axis < 3; ++axis) {
      triangles_.corner[i][axis][lane] = x[axis];
    }
  }
}

void ToolCollision::TakeTouch(const Capsule& now, std::size_t lane, ClosestPoints* closest) const {
  closest->distance_sq = touch_.distance_sq[lane];
  closest->t = touch_.t[lane];
  closest->crosses = touch_.crosses[lane] > 0.0f;
  closest->on_segment = now.a + touch_.t[lane] * (now.b - now.a);
  Vec3f on_triangle = Vec3f::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& x = triangles_.corner[i];
    closest->barycentric[i] = touch_.weight[i][lane];
    on_triangle += touch_.weight[i][lane] * Vec3f(x[0][lane], x[1][lane], x[2][lane]);
  }
  closest->on_triangle = on_triangle;
}

void ToolCollision::AddCandidate(const Candidate& candidate, std::uint32_t capsule, float range) {
  LoadTriangle(candidate.at, batch_count_);
  batch_[batch_count_++] = candidate;
  if (batch_count_ == kLanes) {
    Flush(capsule, range);
  }
}

void ToolCollision::Flush(std::uint32_t capsule, float range) {
  const Motion& motion = motion_[capsule];
  // One sample at the end of the step. Beyond `exact` only the side is needed, for which the centroid is sufficient.
  const TouchSearch search{1.0f, 1.0f, 0.0f, 0.0f, 1.0f, range, motion.to.radius + kNear};
  kernels_.first_touch(motion.segment, search, triangles_, &touch_);
  for (std::size_t lane = 0; lane < batch_count_; ++lane) {
    if (!(touch_.distance_sq[lane] < kSkippedSq)) {
      continue;
    }
    ContactPair& pair = pairs_.emplace_back();
    pair.capsule = capsule;
    pair.triangle = batch_[lane].triangle;
    pair.particle = batch_[lane].particle;
    pair.at = batch_[lane].at;
    TakeTouch(motion.to, lane, &pair.closest);
    pair.normal = NormalOf(pair, false);
    FindSide(&pair);
    // The organ is closed: a triangle that the tool is behind without having been in front is the opposite wall.
    if (pair.triangle >= membrane_triangles_ && pair.side < 0) {
      pairs_.pop_back();
    }
  }
  batch_count_ = 0;
}

Vec3f ToolCollision::NormalOf(const ContactPair& pair, bool previous) {
  if (pair.triangle < membrane_triangles_) {
    Patch& patch = patch_[previous ? 1 : 0];
    if (patch.cell != pair.triangle / 2) {
      patch.cell = pair.triangle / 2;
      patch.normal = PatchNormal(patch.cell, previous);
    }
    return patch.normal;
  }
  const auto at = [&](std::size_t i) {
    return previous ? particles_->Previous(pair.at[i]) : particles_->At(pair.at[i]);
  };
  return (at(1) - at(0)).cross(at(2) - at(0)).normalized();
}

/// From the positions before this step, without overlap, of the two points that are closest now.
void ToolCollision::FindSide(ContactPair* pair) {
  const auto last = std::lower_bound(last_pairs_.begin(), last_pairs_.end(), *pair, InOrder);
  const bool known = last != last_pairs_.end() && last->capsule == pair->capsule && last->triangle == pair->triangle;
  if (known && (last->touching || pair->triangle >= membrane_triangles_) && !OnRim(*pair)) {
    pair->side = last->side;
    pair->side_kept = last->touching;
    return;
  }
  const auto& b = pair->closest.barycentric;
  const Vec3f offset = motion_[pair->capsule].PointAt(pair->closest.t, 0.0f) -
                       (b[0] * particles_->Previous(pair->at[0]) + b[1] * particles_->Previous(pair->at[1]) +
                        b[2] * particles_->Previous(pair->at[2]));
  const float height = NormalOf(*pair, true).dot(offset), steep = kSideCosine * offset.norm();
  if (std::abs(height) > steep && steep > 0.0f) {
    pair->side = height > 0.0f ? std::int8_t{1} : std::int8_t{-1};
  } else if (known) {
    pair->side = last->side;
  }
}

void ToolCollision::FindMembranePairs(std::uint32_t capsule, float range) {
  const Motion& motion = motion_[capsule];
  const Capsule middle = motion.At(0.5f);
  const float half_range = range - 0.5f * motion.travel;
  bounds_.ForEachCellNear(
      middle.a, middle.b, half_range,
      [&](std::uint32_t row, std::uint32_t col, const std::array<ParticleRef, 4>& corner, float) {
        const Index cell = row * (model_->cols() - 1) + col;
        if (!model_->TriangleAlive(2 * cell) && !model_->TriangleAlive(2 * cell + 1)) {
          return;
        }
        const Index n00 = scene_.membrane.first + row * model_->cols() + col, n10 = n00 + model_->cols();
        if (model_->TriangleAlive(2 * cell)) {
          AddCandidate({2 * cell, {n00, n00 + 1, n10 + 1}, {corner[0], corner[1], corner[3]}}, capsule, range);
        }
        if (model_->TriangleAlive(2 * cell + 1)) {
          AddCandidate({2 * cell + 1, {n00, n10 + 1, n10}, {corner[0], corner[3], corner[2]}}, capsule, range);
        }
      });
  Flush(capsule, range);
}

/// The pairs of a capsule from `first` on, sheet by sheet: they follow each other by rows, so those of a sheet do.
void ToolCollision::UnifySides(std::size_t first) {
  const auto sheet_of = [this](const ContactPair& pair) {
    return sheet_of_[pair.triangle / 2 / (scene_.membrane.cols - 1)];
  };
  const std::span<ContactPair> pairs = std::span(pairs_).subspan(first);
  for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
    while (end < pairs.size() && sheet_of(pairs[end]) == sheet_of(pairs[begin])) ++end;
    UnifySidesOfSheet(pairs.subspan(begin, end - begin));
  }
}

/// A capsule is on one side of all of a sheet around it, except at a hole or a rim: that of the pairs that touched in
/// the last step if these agree, else that of all pairs if these agree. A single pair can be wrong: the tool is below
/// the level of the flat membrane around the pit that it presses.
void ToolCollision::UnifySidesOfSheet(std::span<ContactPair> pairs) {
  for (const bool touched : {true, false}) {
    bool above = false, below = false;
    for (const ContactPair& pair : pairs) {
      above |= pair.side > 0 && (pair.side_kept || !touched);
      below |= pair.side < 0 && (pair.side_kept || !touched);
    }
    if (above != below) {
      for (ContactPair& pair : pairs) pair.side = above ? 1 : -1;
    }
    if (above || below) {
      return;
    }
  }
}

void ToolCollision::FindTubePairs(std::uint32_t capsule, float range) {
  const Motion& motion = motion_[capsule];
  const Capsule middle = motion.At(0.5f);
  bounds_.ForEachTubeTriangleNear(middle.a, middle.b, range - 0.5f * motion.travel, [&](Index triangle) {
    const Triangle& v = scene_.tube_surface[triangle];
    AddCandidate({membrane_triangles_ + triangle, v, {{{4 * v[0], 1}, {4 * v[1], 1}, {4 * v[2], 1}}}}, capsule, range);
  });
  Flush(capsule, range);
}

void ToolCollision::UpdateExclusion(std::uint32_t tool, const ToolMotion& moved, bool clear) {
  Exclusion& exclusion = excluded_[tool];
  exclusion.held = moved.hold || (exclusion.held && exclusion.steps > 0);
  if (moved.hold || moved.closing) {
    exclusion.steps = kClearSteps;
  } else if (clear && exclusion.steps > 0) {
    --exclusion.steps;
  }
}

/// Sorts the pairs by capsule and triangle. Keys are sorted, because pairs are large; last_pairs_ serves as the buffer.
void ToolCollision::SortPairs() {
  row_order_.clear();
  for (Index i = 0; i < pairs_.size(); ++i) {
    row_order_.emplace_back(std::uint64_t{pairs_[i].capsule} << 32 | pairs_[i].triangle, i);
  }
  std::sort(row_order_.begin(), row_order_.end());
  last_pairs_.clear();
  for (const auto& [key, index] : row_order_) {
    last_pairs_.push_back(pairs_[index]);
  }
  std::swap(pairs_, last_pairs_);
}

void ToolCollision::FindPairs(const std::array<ToolMotion, kMaxTools>& tools, bool tissue_moved, float tissue_step) {
  std::swap(pairs_, last_pairs_);
  pairs_.clear();
  patch_ = {};
  band_ = kRowBand + std::clamp(tissue_step, 0.0f, kMaxReach);
  if (tissue_moved) {
    std::array<Capsule, kMaxTools * kMaxCapsules> near;
    std::size_t count = 0;
    for (const ToolMotion& moved : tools) {
      std::copy_n(moved.to.capsules.begin(), moved.to.count, near.begin() + static_cast<std::ptrdiff_t>(count));
      count += static_cast<std::size_t>(moved.to.count);
    }
    if (count > 0) {
      bounds_.Update({near.data(), count});
    } else {
      bounds_.Invalidate();
    }
  }
  for (std::uint32_t tool = 0; tool < kMaxTools; ++tool) {
    const ToolMotion& moved = tools[tool];
    bool clear = true;
    for (int i = 0; i < kMaxCapsules; ++i) {
      const std::uint32_t c = tool * kMaxCapsules + static_cast<std::uint32_t>(i);
      motion_[c].enabled = false;
      if (i >= moved.to.count) {
        continue;
      }
      if (moved.hold && moved.to.capsules[static_cast<std::size_t>(i)].part == ToolPart::kJaw) {
        clear = false;
        continue;
      }
      const Capsule from = moved.from.capsules[static_cast<std::size_t>(i)];
      const Capsule to = moved.to.capsules[static_cast<std::size_t>(i)];
      motion_[c] = {from, to, std::max((to.a - from.a).norm(), (to.b - from.b).norm()), true, SegmentOf(from, to)};
      const float range =
          to.radius + ContactMargin(scene_, to.part, thickest_m_) + kSlack + band_ - kRowBand + motion_[c].travel;
      if (!bounds_.MayTouch(to.a, to.b, range)) {
        continue;
      }
      const std::size_t first = pairs_.size();
      FindMembranePairs(c, range);
      UnifySides(first);
      FindTubePairs(c, range);
      if (to.part == ToolPart::kJaw) {
        const float least = excluded_[tool].held ? range : kClearShare * to.radius;
        clear = clear && std::none_of(pairs_.begin() + static_cast<std::ptrdiff_t>(first), pairs_.end(),
                                      [least](const ContactPair& p) { return p.closest.distance_sq < least * least; });
      }
    }
    UpdateExclusion(tool, moved, clear);
  }
  SortPairs();
  for (std::uint32_t c = 0; c < motion_.size(); ++c) {
    if (motion_[c].to.part == ToolPart::kJaw && excluded_[c / kMaxCapsules].steps > 0) {
      motion_[c].enabled = false;
    }
  }
}

void ToolCollision::FitAtRest() {
  bounds_.Invalidate();
  bounds_.Update({});
}

bool ToolCollision::OnRim(const ContactPair& pair) const {
  if (pair.triangle >= membrane_triangles_ || pair.closest.crosses) {
    return false;
  }
  const auto cols = static_cast<int>(model_->cols()) - 1, rows = static_cast<int>(model_->rows()) - 1;
  const int cell = static_cast<int>(pair.triangle / 2), row = cell / cols, col = cell % cols;
  const auto dead = [&](int r, int c, int half) {
    return r < 0 || c < 0 || r >= rows || c >= cols ||
           !model_->TriangleAlive(static_cast<Index>(2 * (r * cols + c) + half));
  };
  const auto& b = pair.closest.barycentric;
  const bool lower = pair.triangle % 2 != 0;
  std::array<bool, 3> off;  // By corner: it has no share in the closest point.
  std::transform(b.begin(), b.end(), off.begin(), [](float weight) { return weight <= 0.0f; });
  if (off[0] + off[1] + off[2] == 2) {
    // At a corner: a rim if one of the six triangles around it is missing. Corners of the halves: 00 01 11, 00 11 10.
    const std::size_t corner = !off[0] ? 0 : !off[1] ? 1 : 2;
    const int r = row + (lower ? corner != 0 : corner == 2), c = col + (lower ? corner == 1 : corner != 0);
    return dead(r - 1, c - 1, 0) || dead(r - 1, c - 1, 1) || dead(r - 1, c, 1) || dead(r, c - 1, 0) || dead(r, c, 0) ||
           dead(r, c, 1);
  }
  if (lower) {
    return (off[2] && dead(row, col, 0)) || (off[0] && dead(row + 1, col, 0)) || (off[1] && dead(row, col - 1, 0));
  }
  return (off[2] && dead(row - 1, col, 1)) || (off[0] && dead(row, col + 1, 1)) || (off[1] && dead(row, col, 1));
}

ToolCollision::Push ToolCollision::PushOf(const ContactPair& pair, const Capsule& capsule) const {
  const ClosestPoints& closest = pair.closest;
  const float reach = capsule.radius + MarginAt(pair.triangle, capsule.part);
  const auto side = static_cast<float>(pair.side);
  const Vec3f offset = closest.on_segment - closest.on_triangle;
  const float distance = std::sqrt(closest.distance_sq);
  if (closest.crosses) {
    if (pair.side == 0 || pair.normal.isZero(0.0f)) {
      return {};  // The tool was through the membrane before the first evaluation: its side is unknown.
    }
    const float behind = std::min(side * pair.normal.dot(capsule.a - closest.on_triangle),
                                  side * pair.normal.dot(capsule.b - closest.on_triangle));
    return behind > -kMaxBehindTool ? Push{reach - behind, -side * pair.normal} : Push{};
  }
  if (side * pair.normal.dot(offset) < -kSideCosine * distance && !OnRim(pair)) {
    // If the pair did not touch in the last step, the tool came behind it in this step or around a rim.
    const float reachable = reach + motion_[pair.capsule].travel + band_;
    return distance < (pair.side_kept ? kMaxBehindTool : std::min(kMaxBehindTool, reachable))
               ? Push{reach + distance, -side * pair.normal}
               : Push{};
  }
  const float length = distance < kRoundedDistance ? offset.norm() : distance;
  return length > 0.0f ? Push{reach - distance, -offset / length} : Push{};
}

bool ToolCollision::any_touching() const {
  return std::any_of(pairs_.begin(), pairs_.end(), [](const ContactPair& p) { return p.touching; });
}

void ToolCollision::TouchedParticles(std::uint32_t tool, std::vector<Index>* particles) const {
  particles->clear();
  for (const ContactPair& pair : pairs_) {
    if (pair.touching && pair.capsule / kMaxCapsules == tool) {
      particles->insert(particles->end(), pair.particle.begin(), pair.particle.end());
    }
  }
  std::sort(particles->begin(), particles->end());
  particles->erase(std::unique(particles->begin(), particles->end()), particles->end());
}

SurfacePoint ToolCollision::Nearest(const Capsule& capsule, float range) const {
  SurfacePoint best;
  const float reach = range + capsule.radius;
  float best_sq = reach * reach;
  const auto offer = [&](Index triangle, const std::array<Index, 3>& particle) {
    const ClosestPoints closest = ClosestSegmentTriangle(
        capsule.a, capsule.b, particles_->At(particles_->Ref(particle[0])),
        particles_->At(particles_->Ref(particle[1])), particles_->At(particles_->Ref(particle[2])));
    if (closest.distance_sq < best_sq) {
      best_sq = closest.distance_sq;
      best = {true, triangle < membrane_triangles_, triangle, closest, std::sqrt(best_sq) - capsule.radius};
    }
  };
  if (!bounds_.MayTouch(capsule.a, capsule.b, reach)) {
    return best;
  }
  // The cell with the nearest centre, then the triangles around it exactly.
  float nearest = kLargestFinite, search = reach;
  Index row = 0, col = 0;
  bounds_.ForEachCellNear(
      capsule.a, capsule.b, search,
      [&](std::uint32_t r, std::uint32_t c, const std::array<ParticleRef, 4>&, float distance_sq) {
        const Index cell = r * (model_->cols() - 1) + c;
        const float distance = std::sqrt(distance_sq);
        if (distance < nearest && (model_->TriangleAlive(2 * cell) || model_->TriangleAlive(2 * cell + 1))) {
          nearest = distance;
          search = std::min(search, distance);
          row = r;
          col = c;
        }
      });
  if (nearest < kLargestFinite) {
    for (Index r = row > 0 ? row - 1 : 0; r < std::min(row + 2, model_->rows() - 1); ++r) {
      for (Index c = col > 0 ? col - 1 : 0; c < std::min(col + 2, model_->cols() - 1); ++c) {
        for (Index t = 2 * (r * (model_->cols() - 1) + c), end = t + 2; t < end; ++t) {
          if (model_->TriangleAlive(t)) {
            std::array<Index, 3> particle = model_->TriangleNodes(t);
            for (Index& p : particle) {
              p += scene_.membrane.first;
            }
            offer(t, particle);
          }
        }
      }
    }
  }
  bounds_.ForEachTubeTriangleNear(capsule.a, capsule.b, std::sqrt(best_sq),
                                  [&](Index t) { offer(membrane_triangles_ + t, scene_.tube_surface[t]); });
  return best;
}

}  // namespace fulcrum::physics
