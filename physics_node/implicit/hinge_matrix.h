// Quadratic bending of all hinges as one matrix (Bergou et al. 2006). The energy of a hinge is
//
//   E = k/2 |sum_i c_i (x_i - X_i)|^2,      K_ij = sum over hinges k c_i c_j,
//
// with stiffness k [N/m], weights c, places x and X at rest [m]: one constant scalar matrix, the same for the three
// axes, over the few hundred particles of hinges, in compressed rows.
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

  /// Removes hinges that a cut has severed, and restores those that are whole again.
  void UpdateTopology(const TissueModel& tissue);
  /// Once, before AddInRegion: lists the rows of each region.
  void AssignRegions(const Partition& partition);
  /// Rows of particles in marked regions.
  void Select(const Partition& partition, std::span<const std::uint8_t> marked, std::vector<std::uint32_t>* rows) const;
  [[nodiscard]] std::size_t row_count() const { return particles_.size(); }

  // A product has two halves: the first reads fields and may run while kernels write other fields, the second (Add)
  // writes one.
  /// -K (place - rest), in these rows.
  void MakeForce(const float* place, std::span<const std::uint32_t> rows);
  /// K p, in these rows; returns their share of p . K p.
  double Multiply(const float* p, std::span<const std::uint32_t> rows);
  /// field += the last force or product, in the same rows.
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
  /// vector_ <- the particles' xyz_ of a field, less `minus`.
  void Gather(const float* field, const float* minus);
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
