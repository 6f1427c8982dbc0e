// Iterations of mode paper with `as: printed`: every constraint by the paper's own formula (printed_formulas.h), one
// after the other in the order of the scene (its non-linear Gauss-Seidel, eq. 4 to 7).
#pragma once

#include <array>
#include <vector>

#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

class PrintedSolver {
 public:
  PrintedSolver(const TissueScene& scene, const TissueModel* model, ParticleStore* particles);

  /// Edges of the organ, volumes, edges of the membrane, bending, links of eq. 9.
  void Iterate();

  /// A spring between a node of the membrane and a vertex of the organ's surface.
  struct Link {
    Index node;    ///< Within the grid.
    Index vertex;  ///< Particle.
    double rest;   ///< [m]
  };
  /// Eq. 9: for each node of the membrane the vertex of least cost, if one is within reach.
  [[nodiscard]] const std::vector<Link>& links() const { return links_; }

 private:
  template <std::size_t N>
  [[nodiscard]] std::array<Eigen::Vector3d, N> Places(const std::array<ParticleRef, N>& at) const;
  template <std::size_t N>
  [[nodiscard]] std::array<double, N> Weights(const std::array<ParticleRef, N>& at) const;
  template <std::size_t N>
  void Put(const std::array<ParticleRef, N>& at, const std::array<Eigen::Vector3d, N>& p);
  void Stretch(const std::array<ParticleRef, 2>& at, double rest);
  void FindLinks(const TissueScene& scene);

  struct Edge {
    std::array<ParticleRef, 2> at;
    double rest;  ///< [m]
  };
  struct Four {
    std::array<ParticleRef, 4> at;
    double rest;  ///< [m^3] or [rad]
  };

  const TissueModel* model_;
  ParticleStore* particles_;
  Index first_node_;
  std::vector<ParticleRef> nodes_;  ///< Of the membrane.
  std::vector<Edge> edges_;
  std::vector<Four> tets_, hinges_;
  std::vector<Link> links_;
};

/// `params` with Table 1 in place of the step, the iterations and the stiffnesses, and without damping, of which the
/// paper says nothing. For the prediction of PbdSolver (explicit Euler).
[[nodiscard]] PhysicsParams AsPrinted(PhysicsParams params);

}  // namespace fulcrum::physics
