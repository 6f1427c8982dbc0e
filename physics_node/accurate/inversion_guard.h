// The organ's law sits at patches of some twenty tetrahedra, so a single one may turn over within a sound patch and
// stay so: a fold finer than the law can see. This adds what the law lacks there and nowhere else,
//
//   E = k V / 2 min(J - J0, 0)^2   for tetrahedra that have been found turned over, until they are sound again,
//
// with J their volume over that at rest. Nothing is added to tissue without folds.
#pragma once

#include <vector>

#include "physics_node/energy/elastic_model.h"

namespace fulcrum::physics::accurate {

class InversionGuard {
 public:
  explicit InversionGuard(const ElasticModel& model);

  /// Once a substep: looks at the next part of all tetrahedra (all of them within kParts substeps), and linearises
  /// those found before. Adds their forces to the tube part of `residual`.
  void Linearise(const float* place, float* residual);
  /// out += K p; returns p . K p.
  double Apply(const float* p, float* out) const;
  /// Of those found, at `place` [J].
  [[nodiscard]] double Energy(const float* place) const;

 private:
  static constexpr std::size_t kParts = 16;
  struct Tet {
    std::array<Index, 4> v{};
    float inverse_volume = 0;  ///< 1 / (6 V) [1/m^3].
    float stiffness = 0;       ///< k V [J].
  };
  struct Found {
    std::size_t tet = 0;
    float stiffness = 0;  ///< Grows while the fold resists [J].
    std::array<Vec3f, 4> gradient{Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero(),
                                  Vec3f::Zero()};  ///< Of J, times the root of the stiffness.
  };
  [[nodiscard]] float RelativeVolume(const Tet& tet, const float* place) const;
  void Look(const float* place);

  std::vector<Tet> tets_;
  std::vector<Found> found_;
  std::size_t next_ = 0;
};

}  // namespace fulcrum::physics::accurate
