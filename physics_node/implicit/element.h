// A sum over up to four particles and what resists its change: bindings, contacts and slides in the linear system.
#pragma once

#include <array>

#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics::implicit {

/// sum_k weight_k x_k, and what resists its change: kt I + m m^T.
struct Element {
  int count = 4;
  std::array<ParticleRef, 4> at;
  std::array<float, 4> weight{0, 0, 0, 0};
  float kt = 0;             ///< [N/m]
  Vec3f m = Vec3f::Zero();  ///< [sqrt(N/m)]
  bool active = true;
};

/// The sum over a field. `e`: an Element or a ContactRow.
template <class Sum>
[[nodiscard]] Vec3f Combine(const Sum& e, const float* field) {
  Vec3f sum = Vec3f::Zero();
  for (int k = 0; k < e.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    sum += e.weight[i] * FieldAt(field, e.at[i]);
  }
  return sum;
}

/// field += weight_k v at each of its particles.
template <class Sum>
void Spread(const Sum& e, const Vec3f& v, float* field) {
  for (int k = 0; k < e.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    AddField(field, e.at[i], e.weight[i] * v);
  }
}

}  // namespace fulcrum::physics::implicit
