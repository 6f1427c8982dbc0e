#include "physics_node/collision/tool_collision.h"

#include <algorithm>
#include <cmath>

namespace fulcrum::physics {
namespace {

/// How far tissue may move in one step's iterations and still be among the pairs [m].
constexpr float kSlack = 0.0015f;
/// One projection moves tissue at most this far: a deep overlap is undone over several steps, not thrown out [m].
constexpr float kMaxPush = 0.001f;
/// A tool deeper behind a triangle than this has gone through it for good: pushing would only tear [m].
constexpr float kMaxBehind = 0.004f;
/// After closing or letting go, jaws collide again when nothing has been in their way for so many steps.
constexpr int kClearSteps = 5;
/// Jaws that have closed on nothing are clear of what is further than this part of their radius from their axis.
constexpr float kClearPart = 0.5f;
/// A sweep is cut into pieces of this part of the capsule's radius …
constexpr float kSweepPiece = 0.8f;
/// … but at most into this many.
constexpr int kMaxPieces = 16;
/// Sides are told by the normal of a patch this many nodes each way, not by that of a triangle: a crumpled triangle
/// turns over without the membrane doing so.
constexpr int kPatch = 3;
/// Tube triangles per bounding sphere.
constexpr std::size_t kChunkSize = 24;
/// With a corner that cannot move, the others must not make up for all of it: they move at most as if this part of the
/// lightest corner's inverse mass stood against them. Three free corners of equal mass have at least 1/3.
constexpr float kLeastShare = 0.25f;
/// On which side of a triangle the tool is, can be told only where its offset is this much along the normal, and not
/// beside an edge.
constexpr float kBehindCosine = 0.7f;

float DistanceToSegment(const Vec3f& p, const Vec3f& a, const Vec3f& b) {
  return (a + ClosestOnSegment(p, a, b) * (b - a) - p).norm();
}

/// Interleaves ten bits of each coordinate: neighbours in space become neighbours in order.
std::uint32_t Morton(const Vec3f& unit) {
  std::uint32_t code = 0;
  for (int bit = 9; bit >= 0; --bit) {
    for (int axis = 0; axis < 3; ++axis) {
      code = code << 1 | (static_cast<std::uint32_t>(unit[axis] * 1023.0f) >> bit & 1u);
    }
  }
  return code;
}

}  // namespace

ToolCollision::ToolCollision(const SceneView& scene, const TissueModel* model, ParticleStore* particles,
                             const PbdSolver* solver)
    : scene_(scene),
      model_(model),
      particles_(particles),
      solver_(solver),
      membrane_triangles_(scene.membrane.triangle_count()),
      slot_blocks_((particles->layout().slots + 7) / 8),
      row_blocks_((std::max(particles->layout().rows, 2u) - 1 + 7) / 8) {
  for (std::size_t i = 0; i < 6; ++i) {
    bound_storage_[i].assign(std::size_t{row_blocks_} * slot_blocks_ * kLanes + kLanes, 0.0f);
    // The kernel stores whole vectors: start on a 32-byte boundary.
    float* data = bound_storage_[i].data();
    while (reinterpret_cast<std::uintptr_t>(data) % 32 != 0) {
      ++data;
    }
    (i < 3 ? bounds_.lo[i] : bounds_.hi[i - 3]) = data;
  }
  Vec3f low = Vec3f::Constant(3e38f), high = Vec3f::Constant(-3e38f);
  for (const Vec3f& p : scene.rest_position) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  std::vector<std::pair<std::uint32_t, Index>> order;
  for (Index t = 0; t < scene.tube_surface.size(); ++t) {
    const Triangle& v = scene.tube_surface[t];
    const Vec3f centre = (scene.rest_position[v[0]] + scene.rest_position[v[1]] + scene.rest_position[v[2]]) / 3.0f;
    order.emplace_back(Morton((centre - low).cwiseQuotient(high - low + Vec3f::Constant(1e-6f))), t);
  }
  std::sort(order.begin(), order.end());
  for (const auto& [code, t] : order) {
    tube_order_.push_back(t);
  }
  for (std::size_t first = 0; first < tube_order_.size(); first += kChunkSize) {
    Chunk chunk;
    chunk.first = static_cast<Index>(first);
    chunk.last = static_cast<Index>(std::min(first + kChunkSize, tube_order_.size()));
    chunks_.push_back(chunk);
  }
  UpdateBounds();
}

void ToolCollision::UpdateBounds() {
  solver_->ComputeBlockBounds(bounds_);
  low_ = Vec3f::Constant(3e38f);
  high_ = Vec3f::Constant(-3e38f);
  const std::size_t blocks = std::size_t{row_blocks_} * slot_blocks_ * kLanes;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < blocks; ++i) {
      low_[axis] = std::min(low_[axis], bounds_.lo[axis][i]);
      high_[axis] = std::max(high_[axis], bounds_.hi[axis][i]);
    }
  }
  for (Chunk& chunk : chunks_) {
    Vec3f lo = Vec3f::Constant(3e38f), hi = Vec3f::Constant(-3e38f);
    for (Index i = chunk.first; i < chunk.last; ++i) {
      for (const Index v : scene_.tube_surface[tube_order_[i]]) {
        const Vec3f p = particles_->At({4 * v, 1});
        lo = lo.cwiseMin(p);
        hi = hi.cwiseMax(p);
      }
    }
    chunk.centre = 0.5f * (lo + hi);
    chunk.radius = 0.5f * (hi - lo).norm();
    low_ = low_.cwiseMin(lo);
    high_ = high_.cwiseMax(hi);
  }
}

template <class Visit>
void ToolCollision::ForEachCellNear(const Vec3f& a, const Vec3f& b, const float& range, const Visit& visit) const {
  const GridLayout& layout = particles_->layout();
  const Vec3f lo = a.cwiseMin(b) - Vec3f::Constant(range), hi = a.cwiseMax(b) + Vec3f::Constant(range);
  std::size_t index = 0;
  for (std::uint32_t rb = 0; rb < row_blocks_; ++rb) {
    for (std::uint32_t sb = 0; sb < slot_blocks_; ++sb) {
      for (std::uint32_t lane = 0; lane < kLanes; ++lane, ++index) {
        const Vec3f block_lo(bounds_.lo[0][index], bounds_.lo[1][index], bounds_.lo[2][index]);
        const Vec3f block_hi(bounds_.hi[0][index], bounds_.hi[1][index], bounds_.hi[2][index]);
        if ((block_lo.array() > hi.array()).any() || (block_hi.array() < lo.array()).any() ||
            DistanceToSegment(0.5f * (block_lo + block_hi), a, b) > range + 0.5f * (block_hi - block_lo).norm()) {
          continue;
        }
        for (std::uint32_t row = 8 * rb; row < std::min(8 * rb + 8, layout.rows - 1); ++row) {
          for (std::uint32_t slot = 8 * sb; slot < std::min(8 * sb + 8, layout.slots); ++slot) {
            const std::uint32_t col = lane * layout.slots + slot;
            if (col + 1 >= layout.cols) {
              break;
            }
            const Vec3f x00 = particles_->At(particles_->NodeRef(row, col));
            const Vec3f x11 = particles_->At(particles_->NodeRef(row + 1, col + 1));
            const Vec3f x01 = particles_->At(particles_->NodeRef(row, col + 1));
            const Vec3f x10 = particles_->At(particles_->NodeRef(row + 1, col));
            const Vec3f centre = 0.25f * (x00 + x01 + x10 + x11);
            const float radius_sq = std::max(std::max((x00 - centre).squaredNorm(), (x11 - centre).squaredNorm()),
                                             std::max((x01 - centre).squaredNorm(), (x10 - centre).squaredNorm()));
            const float distance = DistanceToSegment(centre, a, b);
            if (distance <= range + std::sqrt(radius_sq)) {
              visit(row, col, distance);
            }
          }
        }
      }
    }
  }
}

template <class Visit>
void ToolCollision::ForEachTubeTriangleNear(const Vec3f& a, const Vec3f& b, float range, const Visit& visit) const {
  for (const Chunk& chunk : chunks_) {
    if (DistanceToSegment(chunk.centre, a, b) <= range + chunk.radius) {
      for (Index i = chunk.first; i < chunk.last; ++i) {
        visit(tube_order_[i]);
      }
    }
  }
}

Vec3f ToolCollision::PatchNormal(Index triangle, bool previous) const {
  const GridLayout& layout = particles_->layout();
  const Index cell = triangle / 2, cells = layout.cols - 1;
  const auto row = static_cast<int>(cell / cells), col = static_cast<int>(cell % cells);
  const auto at = [&](int r, int c) {
    const ParticleRef ref =
        particles_->NodeRef(static_cast<Index>(std::clamp(r, 0, static_cast<int>(layout.rows) - 1)),
                            static_cast<Index>(std::clamp(c, 0, static_cast<int>(layout.cols) - 1)));
    return previous ? particles_->Previous(ref) : particles_->At(ref);
  };
  const Vec3f along = at(row, col + kPatch + 1) - at(row, col - kPatch);
  const Vec3f down = at(row + kPatch + 1, col) - at(row - kPatch, col);
  const Vec3f normal = along.cross(down);
  const float area = normal.norm();
  return area > 0.0f ? Vec3f(normal / area) : Vec3f(Vec3f::Zero());
}

void ToolCollision::AddPair(std::uint32_t capsule, Index triangle, const std::array<Index, 3>& particle,
                            const std::array<ParticleRef, 3>& at, float range) {
  const Motion& motion = motion_[capsule];
  ContactPair pair;
  pair.closest = ClosestSegmentTriangle(motion.to.a, motion.to.b, particles_->At(at[0]), particles_->At(at[1]),
                                        particles_->At(at[2]));
  if (pair.closest.distance_sq > range * range) {
    return;
  }
  pair.capsule = capsule;
  pair.triangle = triangle;
  pair.particle = particle;
  pair.at = at;
  if (triangle >= membrane_triangles_) {
    pair.side = 1;  // The organ is closed: tools are outside.
    const Vec3f x0 = particles_->At(at[0]);
    pair.normal = (particles_->At(at[1]) - x0).cross(particles_->At(at[2]) - x0).normalized();
  } else {
    pair.normal = PatchNormal(triangle, false);
    const auto last =
        std::lower_bound(last_pairs_.begin(), last_pairs_.end(), pair, [](const ContactPair& p, const ContactPair& q) {
          return std::pair(p.capsule, p.triangle) < std::pair(q.capsule, q.triangle);
        });
    const bool known = last != last_pairs_.end() && last->capsule == capsule && last->triangle == triangle;
    // Where the two points that are closest now were before this step, when nothing overlapped.
    const auto& b = pair.closest.barycentric;
    const Vec3f x0 = particles_->Previous(at[0]), x1 = particles_->Previous(at[1]), x2 = particles_->Previous(at[2]);
    const Vec3f offset =
        motion.from.a + pair.closest.t * (motion.from.b - motion.from.a) - (b[0] * x0 + b[1] * x1 + b[2] * x2);
    const float height = PatchNormal(triangle, true).dot(offset), steep = kBehindCosine * offset.norm();
    const bool clear = std::abs(height) > steep && steep > 0.0f;
    if (known && (last->touching || !clear)) {
      pair.side = last->side;
    } else if (clear) {
      pair.side = height > 0.0f ? std::int8_t{1} : std::int8_t{-1};
    }
  }
  pairs_.push_back(pair);
}

void ToolCollision::FindMembranePairs(std::uint32_t capsule, float range) {
  const Motion& motion = motion_[capsule];
  ForEachCellNear(motion.to.a, motion.to.b, range, [&](std::uint32_t row, std::uint32_t col, float) {
    const Index cell = row * (model_->cols() - 1) + col;
    for (Index triangle = 2 * cell; triangle < 2 * cell + 2; ++triangle) {
      if (!model_->TriangleAlive(triangle)) {
        continue;
      }
      std::array<Index, 3> particle = model_->TriangleNodes(triangle);
      std::array<ParticleRef, 3> at;
      for (std::size_t i = 0; i < 3; ++i) {
        particle[i] += scene_.membrane.first;
        at[i] = particles_->Ref(particle[i]);
      }
      AddPair(capsule, triangle, particle, at, range);
    }
  });
}

/// Where a pair's own geometry does not tell the side, its neighbours' does when they agree.
void ToolCollision::SettleSides(std::size_t first) {
  bool above = false, below = false;
  for (std::size_t i = first; i < pairs_.size(); ++i) {
    above |= pairs_[i].side > 0;
    below |= pairs_[i].side < 0;
  }
  if (above != below) {
    for (std::size_t i = first; i < pairs_.size(); ++i) {
      pairs_[i].side = above ? 1 : -1;
    }
  }
}

void ToolCollision::FindTubePairs(std::uint32_t capsule, float range) {
  const Motion& motion = motion_[capsule];
  ForEachTubeTriangleNear(motion.to.a, motion.to.b, range, [&](Index triangle) {
    const Triangle& v = scene_.tube_surface[triangle];
    AddPair(capsule, membrane_triangles_ + triangle, v,
            {particles_->Ref(v[0]), particles_->Ref(v[1]), particles_->Ref(v[2])}, range);
  });
}

void ToolCollision::FindPairs(const std::array<ToolMotion, kMaxTools>& tools, bool tissue_moved) {
  std::swap(pairs_, last_pairs_);
  pairs_.clear();
  if (tissue_moved && (tools[0].to.count > 0 || tools[1].to.count > 0)) {
    UpdateBounds();
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
      motion_[c] = {from, to, std::max((to.a - from.a).norm(), (to.b - from.b).norm()), true};
      const float touch = to.radius + scene_.physics.collision_margin_m;
      const float range = touch + kSlack + motion_[c].travel;
      const Vec3f lo = to.a.cwiseMin(to.b), hi = to.a.cwiseMax(to.b);
      if ((lo.array() > high_.array() + range).any() || (hi.array() < low_.array() - range).any()) {
        continue;
      }
      const std::size_t first = pairs_.size();
      FindMembranePairs(c, range);
      SettleSides(first);
      FindTubePairs(c, range);
      if (to.part == ToolPart::kJaw) {
        const float least = yielding_[tool].held ? 3e38f : kClearPart * to.radius;
        clear = clear && std::none_of(pairs_.begin() + static_cast<std::ptrdiff_t>(first), pairs_.end(),
                                      [least](const ContactPair& p) { return p.closest.distance_sq < least * least; });
      }
    }
    Yielding& yielding = yielding_[tool];
    yielding.held = moved.hold || (yielding.held && yielding.steps > 0);
    if (moved.hold || moved.closing) {
      yielding.steps = kClearSteps;
    } else if (clear && yielding.steps > 0) {
      --yielding.steps;
    }
  }
  std::sort(pairs_.begin(), pairs_.end(), [](const ContactPair& p, const ContactPair& q) {
    return std::pair(p.capsule, p.triangle) < std::pair(q.capsule, q.triangle);
  });
  for (std::uint32_t c = 0; c < motion_.size(); ++c) {
    if (motion_[c].to.part == ToolPart::kJaw && yielding_[c / kMaxCapsules].steps > 0) {
      motion_[c].enabled = false;
    }
  }
}

void ToolCollision::Sweep() {
  for (std::size_t first = 0, last = 0; first < pairs_.size(); first = last) {
    const std::uint32_t c = pairs_[first].capsule;
    while (last < pairs_.size() && pairs_[last].capsule == c) {
      ++last;
    }
    const Motion& m = motion_[c];
    if (!m.enabled) {
      continue;
    }
    const int pieces = std::clamp(static_cast<int>(std::ceil(m.travel / (kSweepPiece * m.to.radius))), 1, kMaxPieces);
    for (int piece = 1; piece <= pieces; ++piece) {
      const float u = static_cast<float>(piece) / static_cast<float>(pieces);
      const Capsule now{m.from.a + u * (m.to.a - m.from.a), m.from.b + u * (m.to.b - m.from.b), m.to.radius, m.to.part};
      for (std::size_t p = first; p < last; ++p) {
        ProjectPair(&pairs_[p], now);
      }
    }
  }
}

void ToolCollision::ProjectPair(ContactPair* pair, const Capsule& capsule) {
  const std::array<Vec3f, 3> x{particles_->At(pair->at[0]), particles_->At(pair->at[1]), particles_->At(pair->at[2])};
  pair->touching = false;
  pair->closest = ClosestSegmentTriangle(capsule.a, capsule.b, x[0], x[1], x[2]);
  const ClosestPoints& closest = pair->closest;
  const float reach = capsule.radius + scene_.physics.collision_margin_m;
  const Vec3f& normal = pair->normal;
  const auto side = static_cast<float>(pair->side);
  const Vec3f offset = closest.on_segment - closest.on_triangle;
  const float distance = std::sqrt(closest.distance_sq);
  const float height = normal.dot(offset) * side;
  float depth = 0;
  if (closest.crosses) {
    const float behind = std::min(normal.dot(capsule.a - closest.on_triangle) * side,
                                  normal.dot(capsule.b - closest.on_triangle) * side);
    if (pair->side == 0) {
      return;  // It was through the membrane before we looked: there is no telling which side is right.
    }
    pair->push = -side * normal;
    depth = behind > -kMaxBehind ? reach - behind : 0.0f;
  } else if (height < -kBehindCosine * distance) {
    pair->push = -side * normal;
    depth = distance < kMaxBehind ? reach + distance : 0.0f;
  } else if (distance < reach && distance > 0.0f) {
    pair->push = -offset / distance;
    depth = reach - distance;
  }
  if (!(depth > 0.0f)) {
    return;
  }
  depth = std::min(depth, kMaxPush);
  const auto& b = closest.barycentric;
  std::array<float, 3> w;
  float sum = 0, lightest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const float inverse_mass = particles_->InverseMass(pair->at[i]);
    w[i] = inverse_mass * b[i];
    sum += w[i] * b[i];
    lightest = std::max(lightest, inverse_mass);
  }
  if (!(sum > 0.0f)) {
    return;
  }
  sum = std::max(sum, kLeastShare * lightest);
  pair->touching = true;
  // Coulomb: the point of contact is carried along by at most friction times the push.
  const Motion& m = motion_[pair->capsule];
  const Vec3f tool_step = closest.on_segment - (m.from.a + closest.t * (m.from.b - m.from.a));
  const Vec3f tissue_step =
      closest.on_triangle - (b[0] * particles_->Previous(pair->at[0]) + b[1] * particles_->Previous(pair->at[1]) +
                             b[2] * particles_->Previous(pair->at[2]));
  Vec3f slide = tissue_step - tool_step;
  slide -= slide.dot(pair->push) * pair->push;
  const float sliding = slide.norm(), grip = scene_.physics.friction * depth;
  const Vec3f move = depth * pair->push - (sliding > grip ? Vec3f(slide * (grip / sliding)) : slide);
  for (std::size_t i = 0; i < 3; ++i) {
    if (w[i] > 0.0f) {
      particles_->Set(pair->at[i], x[i] + (w[i] / sum) * move);
    }
  }
}

void ToolCollision::Project() {
  for (ContactPair& pair : pairs_) {
    if (motion_[pair.capsule].enabled) {
      ProjectPair(&pair, motion_[pair.capsule].to);
    }
  }
}

void ToolCollision::Settle() {
  for (const ContactPair& pair : pairs_) {
    if (!pair.touching) {
      continue;
    }
    const Motion& m = motion_[pair.capsule];
    const Vec3f tool_step = pair.closest.on_segment - (m.from.a + pair.closest.t * (m.from.b - m.from.a));
    const float driven = std::max(0.0f, tool_step.dot(pair.push));
    for (const ParticleRef at : pair.at) {
      const Vec3f previous = particles_->Previous(at);
      const float excess = (particles_->At(at) - previous).dot(pair.push) - driven;
      if (excess > 0.0f && particles_->InverseMass(at) > 0.0f) {
        particles_->SetPrevious(at, previous + excess * pair.push);
      }
    }
  }
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
  const Vec3f lo = capsule.a.cwiseMin(capsule.b), hi = capsule.a.cwiseMax(capsule.b);
  if ((lo.array() > high_.array() + reach).any() || (hi.array() < low_.array() - reach).any()) {
    return best;
  }
  // The nearest cell by its centre, then exactly around it.
  float nearest = 3e38f, search = reach;
  Index row = 0, col = 0;
  ForEachCellNear(capsule.a, capsule.b, search, [&](std::uint32_t r, std::uint32_t c, float distance) {
    const Index cell = r * (model_->cols() - 1) + c;
    if (distance < nearest && (model_->TriangleAlive(2 * cell) || model_->TriangleAlive(2 * cell + 1))) {
      nearest = distance;
      search = std::min(search, distance);
      row = r;
      col = c;
    }
  });
  if (nearest < 3e38f) {
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
  ForEachTubeTriangleNear(capsule.a, capsule.b, std::sqrt(best_sq),
                          [&](Index t) { offer(membrane_triangles_ + t, scene_.tube_surface[t]); });
  return best;
}

}  // namespace fulcrum::physics
