#include "physics_node/collision/row_projection.h"

#include <algorithm>

namespace fulcrum::physics {
std::size_t ProjectRows(std::span<ContactRow> rows, float max_push, float dt_s, ParticleStore* particles) {
  std::size_t pushed = 0;
  for (ContactRow& row : rows) {
    const auto count = static_cast<std::size_t>(row.count);
    Vec3f place = Vec3f::Zero(), moved = Vec3f::Zero();
    float sum = 0, lightest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3f x = particles->At(row.at[i]);
      const float inverse_mass = particles->InverseMass(row.at[i]);
      place += row.weight[i] * x;
      moved += row.weight[i] * (x - particles->Previous(row.at[i]));
      sum += inverse_mass * row.weight[i] * row.weight[i];
      lightest = std::max(lightest, inverse_mass);
    }
    const float depth = std::min(row.offset - row.normal.dot(place), max_push);
    if (!(depth > 0.0f) || !(sum > 0.0f)) {
      continue;
    }
    Vec3f slide = moved - row.drift;
    slide -= slide.dot(row.normal) * row.normal;
    const float sliding = slide.norm(), grip = row.friction * depth;
    const Vec3f move = depth * row.normal - (sliding > grip ? Vec3f(slide * (grip / sliding)) : slide);
    sum = std::max(sum, kLeastShare * lightest);
    for (std::size_t i = 0; i < count; ++i) {
      const float share = particles->InverseMass(row.at[i]) * row.weight[i] / sum;
      if (share != 0.0f) {
        particles->Set(row.at[i], particles->At(row.at[i]) + share * move);
      }
    }
    row.force_N += depth / (sum * dt_s * dt_s);
    ++pushed;
  }
  return pushed;
}

}  // namespace fulcrum::physics
