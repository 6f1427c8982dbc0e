// Contact rows for solvers that project positions:
//
//   D   = min(offset - n . y, max_push),   y = sum_k a_k x_k             depth of a violated row, D > 0 [m]
//   m   = D n - t min(1, mu D / |t|)                                     correction with Coulomb friction [m]
//   t   = (dy - drift) - n (n . (dy - drift)),   dy = sum_k a_k (x_k - x_k,prev)          slip along the contact [m]
//   x_k += w_k a_k m / S,   S = max(sum_k w_k a_k^2, kLeastShare max_k w_k) [1/kg]
//   f   += D / (S h^2)                                                   force that moves the mass 1/S by D in h [N]
//
//   n, offset, mu, drift  ContactRow      a_k  weights      w_k  inverse masses [1/kg]      h  (sub)step [s]
#pragma once

#include <span>

#include "physics_node/collision/contact_row.h"
#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics {

/// Least S as a share of the largest inverse mass of a corner. If a corner with a large weight is fixed, free corners
/// with small weights would have to make the whole correction. Three free corners of equal mass have at least 1/3.
inline constexpr float kLeastShare = 0.25f;

/// Projects the violated rows one after the other, at most `max_push` [m] each, and adds to their force_N. Friction
/// acts against the movement since ParticleStore::Previous. Returns the number of violated rows.
std::size_t ProjectRows(std::span<ContactRow> rows, float max_push, float dt_s, ParticleStore* particles);

}  // namespace fulcrum::physics
