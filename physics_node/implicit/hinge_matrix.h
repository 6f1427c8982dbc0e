// Quadratic bending of all hinges as one matrix. Each hinge's energy is k/2 |sum_k c_k (x_k - X_k)|^2, so the three
// axes see the same constant scalar matrix over the few particles that hinges use.
#pragma once

#include <cstdint>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/implicit/regions.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics::implicit {

class HingeMatrix {
 public:
  HingeMatrix(const ElasticModel& model, const ParticleStore& particles);

  /// Takes out hinges that a cut has severed, and puts back those that are whole again.
  void Follow(const TissueModel& tissue);
  /// Once, before AddInRegion: which region each particle is in.
  void Divide(const Regions& regions);
  /// Rows of particles in marked regions.
  void Select(const Regions& regions, std::span<const std::uint8_t> marked, std::vector<std::uint32_t>* rows) const;

  /// Of each particle's diagonal: pool offset of x and what all hinges, severed or not, add to it [N/m].
  [[nodiscard]] std::vector<std::pair<std::uint32_t, float>> Diagonal() const;
  // A product is made in two halves, of which the first may run while others write fields: for Add.
  /// -K (place - rest), in these rows.
  void MakeForce(const float* place, std::span<const std::uint32_t> rows);
  /// K p, in these rows; returns their share of p . K p.
  double Multiply(const float* p, std::span<const std::uint32_t> rows);
  /// Adds what was made last to a field, in the same rows.
  void Add(float* field, std::span<const std::uint32_t> rows) const;
  /// The same in all rows of a region.
  void AddInRegion(int region, float* field) const { Add(field, in_region_[static_cast<std::size_t>(region)]); }
  /// Of these rows at `place` [J].
  [[nodiscard]] double Energy(const float* place, std::span<const std::uint32_t> rows);

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
  /// use(i, xyz_ of row i of K x) for these rows; returns their share of x . K x. load(k): xyz_ of particle k in x.
  template <class Load, class Use>
  double ForRows(std::span<const std::uint32_t> rows, const Load& load, const Use& use) const;

  std::vector<Hinge> hinges_;
  std::vector<ParticleRef> particles_;
  std::vector<std::vector<std::uint32_t>> in_region_;  ///< Rows by region.
  std::vector<std::uint32_t> start_, column_;
  std::vector<float> value_;
  FloatArray rest_, vector_, product_;  ///< xyz_ per particle.
};

}  // namespace fulcrum::physics::implicit
