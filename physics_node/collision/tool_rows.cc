// Contacts for solvers that take rows.
#include <algorithm>
#include <cmath>

#include "physics_node/collision/tool_collision.h"

namespace fulcrum::physics {
namespace {

/// A tool that moves less than this part of its radius is looked at in its last place only.
constexpr float kSmallMove = 0.25f;
/// On the way to the first touch a look is at least this part of the radius further, or kMaxLooks would not do.
constexpr float kLeastAdvance = 0.5f;
constexpr float kMaxLooks = 24.0f;
constexpr float kFarSq = 1.0f;

/// The corners that a row rests on when they are one or two: equal for all triangles that share them.
std::uint64_t SharedFeature(const ContactRow& row) {
  const std::uint64_t a = row.at[0].base, b = row.count == 2 ? row.at[1].base : a;
  return std::min(a, b) << 32 | std::max(a, b);
}

}  // namespace

float ToolCollision::FirstTouch(ContactPair* pair, const std::array<Vec3f, 3>& x, float u0, float u1) const {
  const Motion& m = motion_[pair->capsule];
  const float reach = m.to.radius + scene_.physics.collision_margin_m;
  const auto look = [&](float u) {
    const Capsule now = m.At(u);
    return ClosestSegmentTriangle(now.a, now.b, x[0], x[1], x[2]);
  };
  if (!((u1 - u0) * m.travel > kSmallMove * m.to.radius)) {
    pair->closest = look(u1);
    return u1;
  }
  // Conservative advancement: no point of the capsule moves further than travel * du.
  const float least = std::max(kLeastAdvance * m.to.radius / m.travel, (u1 - u0) / kMaxLooks);
  float nearest = 3e38f, at = u1;
  for (float u = u0;;) {
    const ClosestPoints closest = look(u);
    if (closest.distance_sq < nearest) {
      nearest = closest.distance_sq;
      at = u;
      pair->closest = closest;
    }
    if (u >= u1 || closest.distance_sq <= reach * reach) {
      return at;
    }
    u = std::min(u1, u + std::max((std::sqrt(closest.distance_sq) - reach) / m.travel, least));
  }
}

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
  row.force_N = push.depth;  // Until the rows are complete: the deepest win.
  rows->push_back(row);
}

/// Takes out rows marked by count 0.
void ToolCollision::DropMarked(std::size_t first, std::vector<ContactRow>* rows) {
  rows->erase(std::remove_if(rows->begin() + static_cast<std::ptrdiff_t>(first), rows->end(),
                             [](const ContactRow& row) { return row.count == 0; }),
              rows->end());
}

/// All triangles around a corner or an edge give the same row: one is enough.
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

void ToolCollision::Rows(float u0, float u1, std::vector<ContactRow>* rows) {
  rows->clear();
  std::size_t tool_first = 0, capsule_first = 0;
  for (Index index = 0; index < pairs_.size(); ++index) {
    ContactPair& pair = pairs_[index];
    if (index > 0 && pair.capsule != pairs_[index - 1].capsule) {
      DropRepeated(capsule_first, rows);
      if (pair.capsule / kMaxCapsules != pairs_[index - 1].capsule / kMaxCapsules) {
        DropShallow(tool_first, rows);
        tool_first = rows->size();
      }
      capsule_first = rows->size();
    }
    const Motion& m = motion_[pair.capsule];
    if (!m.enabled) {
      continue;
    }
    const std::array<Vec3f, 3> x{particles_->At(pair.at[0]), particles_->At(pair.at[1]), particles_->At(pair.at[2])};
    const float reach = m.to.radius + scene_.physics.collision_margin_m;
    if (IsFar(x, m.At(0.5f * (u0 + u1)),
              reach + (u1 < 1.0f ? band_ : std::max(band_, Probed(m.to))) + 0.5f * m.travel * (u1 - u0))) {
      pair.closest.distance_sq = kFarSq;
      pair.closest.crosses = false;
      continue;
    }
    const float u = FirstTouch(&pair, x, u0, u1);
    Push push = PushOf(pair, m.At(u));
    const Vec3f end = m.PointAt(pair.closest.t, u1), tool_step = end - m.PointAt(pair.closest.t, u0);
    push.depth += push.direction.dot(end - m.PointAt(pair.closest.t, u));
    push.depth = std::min(push.depth, kMaxPush + std::max(0.0f, push.direction.dot(tool_step)));
    if (push.depth > -band_) {
      pair.push = push.direction;
      AddRow(index, push, tool_step, rows);
    }
  }
  DropRepeated(capsule_first, rows);
  DropShallow(tool_first, rows);
  for (ContactRow& row : *rows) {
    row.force_N = 0.0f;
  }
}

void ToolCollision::TakeForces(std::span<const ContactRow> rows) {
  force_.fill(Vec3f::Zero());
  for (ContactPair& pair : pairs_) {
    pair.touching = false;
  }
  for (const ContactRow& row : rows) {
    if (row.source < pairs_.size()) {
      pairs_[row.source].touching = row.force_N > 0.0f;
      force_[pairs_[row.source].capsule / kMaxCapsules] -= row.force_N * row.normal + row.friction_N;
    }
  }
}

}  // namespace fulcrum::physics
