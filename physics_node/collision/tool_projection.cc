// Contacts for solvers that project positions.
//
//   D    = min(depth, kMaxPush)                                        depth, unit direction n: ToolCollision::PushOf
//   m    = D n - t min(1, mu D / |t|)                                  correction with Coulomb friction [m]
//   t    = (dy - dz) - n (n . (dy - dz))                               slip of the tissue on the tool [m]
//   x_i += w_i b_i m / S,   S = max(sum_i w_i b_i^2, kLeastShare max_i w_i)                                   [1/kg]
//
//   dy, dz  movement in this step of the closest points on triangle and tool [m]        b_i  barycentric coordinates
//   w_i     inverse masses [1/kg], 0 = fixed          mu  PhysicsParams::friction
#include <algorithm>
#include <cmath>

#include "physics_node/collision/row_projection.h"
#include "physics_node/collision/tool_collision.h"

namespace fulcrum::physics {
namespace {

/// Length of a piece of a sweep over the radius of the capsule: below 1, so that no tissue is skipped between pieces.
constexpr float kSweepPiece = 0.8f;
/// Most pieces of a sweep; bounds its cost.
constexpr int kMaxPieces = 16;

}  // namespace

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
      const Capsule now = m.At(u);
      for (std::size_t p = first; p < last; ++p) {
        ProjectPair(&pairs_[p], now);
      }
    }
  }
}

void ToolCollision::ProjectPair(ContactPair* pair, const Capsule& capsule) {
  const std::array<Vec3f, 3> x{particles_->At(pair->at[0]), particles_->At(pair->at[1]), particles_->At(pair->at[2])};
  pair->touching = false;
  if (IsFar(x, capsule, capsule.radius + MarginAt(pair->triangle, capsule.part) + ProbeRange(capsule))) {
    pair->closest.distance_sq = kFarSq;
    pair->closest.crosses = false;
    return;
  }
  pair->closest = ClosestSegmentTriangle(capsule.a, capsule.b, x[0], x[1], x[2]);
  const ClosestPoints& closest = pair->closest;
  const Push push = PushOf(*pair, capsule);
  if (!(push.depth > 0.0f)) {
    return;
  }
  pair->push = push.direction;
  const float depth = std::min(push.depth, kMaxPush);
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
  // Coulomb: the tool moves the point of contact along by at most friction times the push.
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

}  // namespace fulcrum::physics
