// The energy of an ElasticModel as defined in physics_node/energy/elastic_model.h, with gradient and Hessian, in
// double. Truth for the solvers: linked into tests and benchmarks only.
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "physics_node/energy/elastic_model.h"

namespace fulcrum::physics::reference {

using Points = Eigen::Matrix<double, 3, Eigen::Dynamic>;
using SparseMatrix = Eigen::SparseMatrix<double>;

[[nodiscard]] Points RestPoints(const ElasticModel& model);

class ElasticEnergy {
 public:
  explicit ElasticEnergy(ElasticModel model);

  [[nodiscard]] const ElasticModel& model() const { return model_; }
  [[nodiscard]] Eigen::Index particle_count() const { return static_cast<Eigen::Index>(model_.mass.size()); }
  /// Removes membrane edge 3 * node + direction: its spring, and the triangles that it is in.
  void CutEdge(std::size_t edge);

  /// Elastic energy, and potential of gravity and of the dead load [J].
  [[nodiscard]] double Energy(const Points& x) const;
  /// dE/dx [N], also on particles that are fixed.
  void Gradient(const Points& x, Points* gradient) const;
  /// d2E/dx2, lower triangle, 3n x 3n [N/m]. With `positive`, each element's part is clamped to be positive
  /// semidefinite, so that a Newton step is a descent direction everywhere. Of slides always without the change of
  /// the normal.
  [[nodiscard]] SparseMatrix Hessian(const Points& x, bool positive) const;

 private:
  /// Springs whose ends are consecutive particles at a constant distance, as the rows of the grid are: `count` springs
  /// first + i, first + offset + i. Planes instead of index lists let the compiler use vectors.
  struct SpringRun {
    Index first = 0, offset = 0;
    std::size_t begin = 0, count = 0;
  };

  void BuildRuns();
  /// Its springs' part of an edge, by the triangles that are whole.
  void RefreshSpring(std::size_t edge);
  void TriangleGradient(const Points& x, Points* gradient) const;
  [[nodiscard]] TriangleTerms TermsOf(const ElasticTriangle& triangle, const Points& x,
                                      TriangleCoupling coupling) const;
  [[nodiscard]] Vec3d Along(std::size_t edge, const Points& x) const;
  void SpringGradient(const Points& x, Points* gradient) const;
  void OrganGradient(const Points& x, Points* gradient) const;

  ElasticModel model_;
  std::vector<double> whole_axial_;                     ///< By edge: [N]; 0 where cut.
  std::vector<std::vector<std::size_t>> triangles_of_;  ///< By edge.
  std::vector<SpringRun> runs_;
  std::vector<double> rest_length_, axial_;           ///< In the order of the runs.
  std::vector<std::size_t> place_;                    ///< Index of each spring of the model in that order.
  mutable std::vector<double> plane_, spring_force_;  ///< Scratch.
};

/// sum over elements of mass v^2 / 2 [J].
[[nodiscard]] double KineticEnergy(const ElasticModel& model, const Points& velocity);

/// Volume of the tets [m^3].
[[nodiscard]] double OrganVolume(const ElasticModel& model, const Points& x);
[[nodiscard]] double TetVolume(const ElasticTet& tet, const Points& x);
[[nodiscard]] int InvertedTets(const ElasticModel& model, const Points& x);

}  // namespace fulcrum::physics::reference
