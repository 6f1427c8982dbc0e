// Projective dynamics (Bouaziz et al. 2014), as Qian et al. used it for dissection: each iteration projects every
// element by itself, then solves one linear system for all, whose sparse Cholesky factor is computed beforehand. Grasps
// and cuts change the matrix, so each requires a new factorisation.
#pragma once

#include <Eigen/SparseCholesky>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "tests/numerics/physics/solver_under_test.h"

namespace fulcrum::physics::baselines {

class ProjectiveDynamics final : public SolverUnderTest {
 public:
  static constexpr int kIterations = 10;

  explicit ProjectiveDynamics(const SceneView& scene);
  void SetPositions(std::span<const float> xyz) override;
  void ReadPositions(std::span<float> xyz) const override;
  void Hold(std::span<const Index> particles) override;
  void MoveHeld(std::span<const Vec3f> places) override;
  void CutEdges(std::span<const std::size_t> edges) override;
  void Step() override;

 private:
  using Matrix = Eigen::SparseMatrix<double>;
  using Points = Eigen::Matrix<double, Eigen::Dynamic, 3>;

  void Factor();
  [[nodiscard]] Points LocalStep();

  double dt_;
  ElasticModel model_;
  Points x_, v_;
  std::vector<Eigen::Quaterniond> turn_;  ///< Rotation of each tet, kept from iteration to iteration.
  std::vector<Index> held_;
  std::vector<bool> is_held_;
  Points held_place_;
  std::vector<int> unknown_;  ///< Row in the system by particle; -1: fixed or held.
  std::vector<Index> free_;
  Matrix coupling_;  ///< System rows times columns of all particles.
  Eigen::SimplicialLLT<Matrix> factor_;
  bool factor_due_ = true;
};

}  // namespace fulcrum::physics::baselines
