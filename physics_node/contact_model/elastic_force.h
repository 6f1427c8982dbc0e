// Forces in newtons out of positions. PBD's own corrections depend on masses, iterations and the time step; the force
// that a hand should feel is that of the material. So each edge is given the stiffness of the continuum it stands for,
// and the force on a particle is that of its stretched edges as PBD has left them.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics {

class ElasticForce {
 public:
  ElasticForce(const SceneView& scene, const TissueModel* model, const ParticleStore* particles);

  /// Force of the tissue on a set of particles together [N, frame W]: forces within the set cancel. At rest under a
  /// tool this is what the set does to the tool. `set` ascending, each once.
  [[nodiscard]] Vec3f OnSet(std::span<const Index> set) const;
  /// Stiffness of the edges from inside the set to outside it [N/m]: the skin around a contact.
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

  SceneView scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  std::vector<float> membrane_stiffness_;  ///< [3 * nodes], N/m.
  std::vector<Index> tube_start_;
  std::vector<TubeEdge> tube_edges_;
  float binding_stiffness_ = 0;  ///< [N/m]
};

}  // namespace fulcrum::physics
