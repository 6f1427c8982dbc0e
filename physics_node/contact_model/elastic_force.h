// Forces in newtons from the positions of a PBD solver. Its corrections depend on masses, iterations and the time step;
// the force on the hand must be that of the material. So each edge has the stiffness of the continuum that it stands
// for, and the force on a particle is that of its edges at the final positions of a step:
//
//   f_i = sum_j k_ij (l_ij - L_ij) (x_j - x_i) / l_ij,   l_ij = |x_j - x_i|       membrane: only where l_ij > L_ij
//       + k_b (|d| - L_b) d / |d|,   d = sum_k b_k s_k - x_i                      binding to the organ
//   k_ij = 8/9 E t A / l^2 per triangle of the membrane,   5/6 E V / l^2 per tetrahedron, at rest
//   k_b  = E_fat (A_sheet / n) / mean length of the n bindings
//
//   k [N/m]     l, L  length now and at rest [m]     E t [N/m], E [Pa]  moduli     A [m^2], V [m^3]  of the element
//   b_k, s_k    barycentric coordinates and corners of the bound triangle
#pragma once

#include <array>
#include <span>
#include <vector>

#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics {

class ElasticForce {
 public:
  ElasticForce(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles);

  /// Total force of the tissue on a set of particles [N, frame W]; forces within the set cancel. In equilibrium with a
  /// tool it is the force of the set on the tool. `set` ascending, without repetition.
  [[nodiscard]] Vec3f OnSet(std::span<const Index> set) const;
  /// Sum of the stiffnesses of the edges between the set and other particles [N/m]: the skin around a contact.
  [[nodiscard]] float StiffnessAround(std::span<const Index> set) const;
  /// Force on one particle [N].
  [[nodiscard]] Vec3f OnParticle(Index particle) const;

 private:
  struct TubeEdge {
    Index other;
    float rest, stiffness;
  };
  template <class Visit>
  void ForEachNeighbour(Index particle, const Visit& visit) const;

  TissueScene scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  std::vector<float> membrane_stiffness_;  ///< [3 * nodes], N/m.
  std::vector<Index> tube_start_;
  std::vector<TubeEdge> tube_edges_;
  std::vector<float> binding_stiffness_;  ///< By row of the membrane [N/m].
};

}  // namespace fulcrum::physics
