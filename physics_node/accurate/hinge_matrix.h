// Quadratic bending of all hinges as one matrix. Each hinge's energy is k/2 |sum_k c_k (x_k - X_k)|^2, so the three
// axes see the same constant scalar matrix over the few particles that hinges use.
#pragma once

#include <cstdint>
#include <vector>

#include "physics_node/accurate/regions.h"
#include "physics_node/energy/elastic_model.h"
#include "physics_node/pbd/tissue_model.h"

namespace fulcrum::physics::accurate {

class HingeMatrix {
 public:
  HingeMatrix(const ElasticModel& model, const ParticleStore& particles);

  /// Takes out hinges that a cut has severed, and puts back those that are whole again.
  void Follow(const TissueModel& tissue);
  /// From now on only rows of particles in regions that are computed.
  void FollowRegions(const Regions& regions);

  /// Of each particle's diagonal: pool offset of x and what all hinges, severed or not, add to it [N/m].
  [[nodiscard]] std::vector<std::pair<std::uint32_t, float>> Diagonal() const;
  /// force -= K (place - rest).
  void AddForce(const float* place, float* force);
  /// out += K p; returns p . K p.
  double Apply(const float* p, float* out);
  /// At `place` [J].
  [[nodiscard]] double Energy(const float* place);

 private:
  struct Hinge {
    std::array<std::uint32_t, 4> particle;
    std::array<float, 4> weight;
    float stiffness = 0;
    bool whole = true;
  };
  void Assemble();
  /// vector_ <- the particles' xyz_ of a field, `minus` taken off.
  void Take(const float* field, const float* minus);
  /// use(i, xyz_ of row i of K vector_) for rows that are computed; returns vector_ . K vector_ over them.
  template <class Use>
  double Multiply(const Use& use) const;

  std::vector<Hinge> hinges_;
  std::vector<ParticleRef> particles_;
  std::vector<std::uint32_t> start_, column_;
  std::vector<float> value_;
  std::vector<std::uint32_t> active_;  ///< Rows that are computed.
  FloatArray rest_, vector_;           ///< xyz_ per particle.
};

}  // namespace fulcrum::physics::accurate
