// Contacts for solvers that take rows.
//
//   n . y >= n . y0 + D                  row of the point y = sum_i b_i x_i of a triangle, now at y0
//   D  = min(depth - c + n . (z(u1) - z(u)), kMaxPush + max(0, n . (z(u1) - z(u0))))       required movement [m]
//
//   u         first touch in [u0, u1] (kernel first_touch)      depth, n  push at u (ToolCollision::PushOf)
//   z         closest point on the tool [m]                     c         MarginReduction [m]
//
// A row exists from D > -band_ on, that is before touch.
#include <algorithm>
#include <cmath>

#include "physics_node/collision/tool_collision.h"

namespace fulcrum::physics {
namespace {

/// Travel of a tool in a substep over its radius below which it is evaluated only at the end of the substep.
constexpr float kSampledTravel = 0.25f;
/// Least advance from sample to sample in the search for the first touch, over the radius, so that samples overlap; it
/// is larger if more than kMaxSamples would be needed, which bounds the cost.
constexpr float kLeastAdvance = 0.5f;
constexpr float kMaxSamples = 24.0f;

/// Key of a row on one or two corners: the same for all triangles that share them.
std::uint64_t SharedFeature(const ContactRow& row) {
  const std::uint64_t a = row.at[0].base, b = row.count == 2 ? row.at[1].base : a;
  return std::min(a, b) << 32 | std::max(a, b);
}

}  // namespace

void ToolCollision::AddRow(Index index, const Push& push, const Vec3f& tool_step, std::vector<ContactRow>* rows) const {
  const ContactPair& pair = pairs_[index];
  ContactRow row;
  bool movable = false;
  float place = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const float weight = pair.closest.barycentric[i];
    if (weight > 0.0f) {
      row.at[static_cast<std::size_t>(row.count)] = pair.at[i];
      row.weight[static_cast<std::size_t>(row.count)] = weight;
      ++row.count;
      place += weight * push.direction.dot(particles_->At(pair.at[i]));
      movable |= particles_->InverseMass(pair.at[i]) > 0.0f;
    }
  }
  if (!movable) {
    return;
  }
  row.normal = push.direction;
  row.offset = place + push.depth;
  row.friction = scene_.physics.friction;
  row.drift = tool_step;
  row.source = index;
  row.force_N = push.depth;  // Until the rows are complete: key for keeping the deepest ones.
  rows->push_back(row);
}

bool ToolCollision::MoveOffOpenCells(const Capsule& capsule, float range, ContactPair* pair) const {
  if (pair->triangle >= membrane_triangles_) {
    return true;
  }
  const float cell = scene_.thermal.cell_m;
  SheetTriangle triangle;
  Vec2f material = Vec2f::Zero();
  const auto nodes = model_->TriangleNodes(pair->triangle);
  for (std::size_t i = 0; i < 3; ++i) {
    triangle.material[i] = scene_.membrane_material[nodes[i]];
    material += pair->closest.barycentric[i] * triangle.material[i];
  }
  if (!IsOpenAt(open_, cell, material)) {
    return true;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    triangle.place[i] = particles_->At(pair->at[i]);
  }
  return NearestRemaining(open_, cell, triangle, capsule.a, capsule.b, range, &pair->closest);
}

/// The margin is measured from the middle of the sheet, for half of its thickness. Along the sheet, at a rim, there is
/// no such layer.
float ToolCollision::MarginReduction(const ContactPair& pair, ToolPart part, const Vec3f& direction) const {
  if (pair.triangle >= membrane_triangles_ || part != ToolPart::kTip) {
    return 0.0f;
  }
  const Vec3f a = particles_->At(pair.at[0]);
  const Vec3f normal = (particles_->At(pair.at[1]) - a).cross(particles_->At(pair.at[2]) - a).normalized();
  return MarginAt(pair.triangle, part) * (1.0f - std::abs(normal.dot(direction)));
}

/// Removes the rows that are marked by count 0.
void ToolCollision::DropMarked(std::size_t first, std::vector<ContactRow>* rows) {
  rows->erase(std::remove_if(rows->begin() + static_cast<std::ptrdiff_t>(first), rows->end(),
                             [](const ContactRow& row) { return row.count == 0; }),
              rows->end());
}

/// All triangles around a corner or an edge give the same row: the deepest of them is kept.
void ToolCollision::DropRepeated(std::size_t first, std::vector<ContactRow>* rows) {
  row_order_.clear();
  for (std::size_t i = first; i < rows->size(); ++i) {
    if ((*rows)[i].count <= 2) {
      row_order_.emplace_back(SharedFeature((*rows)[i]), static_cast<Index>(i));
    }
  }
  std::sort(row_order_.begin(), row_order_.end());
  for (std::size_t i = 0, best = 0; i < row_order_.size(); ++i) {
    if (i == 0 || row_order_[i].first != row_order_[best].first) {
      best = i;
      continue;
    }
    ContactRow &kept = (*rows)[row_order_[best].second], &other = (*rows)[row_order_[i].second];
    if (other.force_N > kept.force_N) {
      kept.count = 0;
      best = i;
    } else {
      other.count = 0;
    }
  }
  DropMarked(first, rows);
}

void ToolCollision::DropShallow(std::size_t first, std::vector<ContactRow>* rows) {
  if (rows->size() - first <= kMaxRows) {
    return;
  }
  row_order_.clear();
  for (std::size_t i = first; i < rows->size(); ++i) {
    row_order_.emplace_back(0, static_cast<Index>(i));
  }
  const auto cut = row_order_.begin() + static_cast<std::ptrdiff_t>(kMaxRows);
  std::nth_element(row_order_.begin(), cut, row_order_.end(), [&](const auto& p, const auto& q) {
    const float deep_p = (*rows)[p.second].force_N, deep_q = (*rows)[q.second].force_N;
    return deep_p != deep_q ? deep_p > deep_q : p.second < q.second;
  });
  for (auto drop = cut; drop != row_order_.end(); ++drop) {
    (*rows)[drop->second].count = 0;
  }
  DropMarked(first, rows);
}

void ToolCollision::AddRows(Index first, Index last, float u0, float u1, std::vector<ContactRow>* rows) {
  const Motion& m = motion_[pairs_[first].capsule];
  const float reach = m.to.radius + ContactMargin(scene_, m.to.part, thickest_m_);
  const float range = reach + (u1 < 1.0f ? band_ : std::max(band_, ProbeRange(m.to))) + 0.5f * m.travel * (u1 - u0);
  const bool moves = (u1 - u0) * m.travel > kSampledTravel * m.to.radius;
  const float least = moves ? std::max(kLeastAdvance * m.to.radius / m.travel, (u1 - u0) / kMaxSamples) : 1.0f;
  const TouchSearch search{u0, u1, reach, moves ? m.travel : 0.0f, least, range, range};
  for (Index i = first; i < last; ++i) {
    LoadTriangle(pairs_[i].at, i - first);
  }
  kernels_.first_touch(m.segment, search, triangles_, &touch_);
  for (Index index = first; index < last; ++index) {
    ContactPair& pair = pairs_[index];
    const std::size_t lane = index - first;
    if (!(touch_.distance_sq[lane] < kFarSq)) {
      pair.closest.distance_sq = kFarSq;
      pair.closest.crosses = false;
      continue;
    }
    const float u = touch_.u[lane];
    const Capsule now = m.At(u);
    TakeTouch(now, lane, &pair.closest);
    if (!MoveOffOpenCells(now, range, &pair)) {
      pair.closest.distance_sq = kFarSq;
      pair.closest.crosses = false;
      continue;
    }
    Push push = PushOf(pair, now);
    push.depth -= MarginReduction(pair, now.part, push.direction);
    const Vec3f end = m.PointAt(pair.closest.t, u1), tool_step = end - m.PointAt(pair.closest.t, u0);
    push.depth += push.direction.dot(end - m.PointAt(pair.closest.t, u));
    push.depth = std::min(push.depth, kMaxPush + std::max(0.0f, push.direction.dot(tool_step)));
    if (push.depth > -band_) {
      pair.push = push.direction;
      AddRow(index, push, tool_step, rows);
    }
  }
}

void ToolCollision::Rows(float u0, float u1, std::vector<ContactRow>* rows) {
  rows->clear();
  const auto count = static_cast<Index>(pairs_.size());
  std::size_t tool_first = 0;
  for (Index first = 0, last = 0; first < count; first = last) {
    const std::uint32_t capsule = pairs_[first].capsule;
    while (last < count && pairs_[last].capsule == capsule) {
      ++last;
    }
    const std::size_t capsule_first = rows->size();
    for (Index i = first; i < last && motion_[capsule].enabled; i += kLanes) {
      AddRows(i, std::min(i + kLanes, last), u0, u1, rows);
    }
    DropRepeated(capsule_first, rows);
    if (last == count || pairs_[last].capsule / kMaxCapsules != capsule / kMaxCapsules) {
      DropShallow(tool_first, rows);
      tool_first = rows->size();
    }
  }
  for (ContactRow& row : *rows) {
    row.force_N = 0.0f;
    row.unbalanced_N.setZero();
  }
}

void ToolCollision::TakeForces(std::span<const ContactRow> rows) {
  force_.fill(Vec3f::Zero());
  for (ContactPair& pair : pairs_) {
    pair.touching = false;
  }
  std::array<Vec3f, kMaxTools> pressure, unbalanced;
  pressure.fill(Vec3f::Zero());
  unbalanced.fill(Vec3f::Zero());
  for (const ContactRow& row : rows) {
    if (row.source < pairs_.size()) {
      const std::uint32_t tool = pairs_[row.source].capsule / kMaxCapsules;
      pairs_[row.source].touching = row.force_N > 0.0f;
      pressure[tool] += row.force_N * row.normal;
      unbalanced[tool] += row.unbalanced_N;
      force_[tool] -= row.force_N * row.normal + row.friction_N;
    }
  }
  // What the tissue does not resist yet is no force on the tool, which is prescribed. Along the normal alone: with the
  // part along the surface, the forces of sliding tools are farther off.
  for (std::size_t tool = 0; tool < kMaxTools; ++tool) {
    const Vec3f normal = pressure[tool].stableNormalized();
    force_[tool] += std::min(pressure[tool].norm(), normal.dot(unbalanced[tool])) * normal;
  }
}

}  // namespace fulcrum::physics
