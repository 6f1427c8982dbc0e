// A mass-spring system with semi-implicit Euler steps, as interactive simulators of dissection have used (Pan et al.):
// edges of the membrane and of the organ's tetrahedra are springs, bindings too. No volumes, no solve.
#pragma once

#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "tests/numerics/physics/solver_under_test.h"

namespace fulcrum::physics::baselines {

class MassSpring final : public SolverUnderTest {
 public:
  /// Substeps of a frame. Explicit steps explode above a stiffness of about m / h^2, so no spring is stiffer than that
  /// allows: with the true stiffnesses a frame would take some 600 substeps.
  static constexpr int kSubsteps = 20;

  explicit MassSpring(const SceneView& scene);
  void SetPositions(std::span<const float> xyz) override;
  void ReadPositions(std::span<float> xyz) const override;
  void Hold(std::span<const Index> particles) override;
  void MoveHeld(std::span<const Vec3f> places) override;
  void CutEdges(std::span<const std::size_t> edges) override;
  void Step() override;

 private:
  struct Spring {
    Index a, b;
    double rest, stiffness;
  };
  void AddOrgan(const ElasticModel& model);
  void LimitStiffness(double h);

  double dt_;
  ElasticModel model_;
  std::vector<Spring> springs_;  ///< The membrane's 3 * node + direction first.
  std::vector<Vec3d> x_, v_, force_;
  std::vector<double> w_;  ///< Inverse mass; 0 for fixed and held particles [1/kg].
  std::vector<Index> held_;
  std::vector<Vec3d> begin_, end_;
};

}  // namespace fulcrum::physics::baselines
