// Contact rows for solvers that project positions.
#pragma once

#include <span>

#include "physics_node/collision/contact_row.h"
#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics {

/// With a corner that cannot move, the others must not make up for all of it: they move at most as if this part of the
/// lightest corner's inverse mass stood against them. Three free corners of equal mass have at least 1/3.
inline constexpr float kLeastShare = 0.25f;

/// Moves particles until each violated row in turn holds, by at most `max_push` [m] a row, with Coulomb friction
/// against the movement since ParticleStore::Previous. Inverse masses share the work. Adds to each row's force_N the
/// force that would have moved the particles as far within dt_s. Returns how many rows pushed.
std::size_t ProjectRows(std::span<ContactRow> rows, float max_push, float dt_s, ParticleStore* particles);

}  // namespace fulcrum::physics
