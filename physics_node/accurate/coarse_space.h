// The coarse level of the two-level solver: a few dozen nodes that carry what neighbours alone would take hundreds of
// sweeps to tell one another. Bilinear in the membrane's rows and columns, trilinear on a lattice of 30 mm over the
// organ; Galerkin matrix A_c = P^T A P, factored dense.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <span>
#include <vector>

#include "physics_node/accurate/kernels.h"
#include "physics_node/energy/elastic_model.h"
#include "physics_node/pbd/particle_store.h"

namespace fulcrum::physics::accurate {

class CoarseSpace {
 public:
  CoarseSpace(const SceneView& scene, const ElasticModel& model, const ParticleStore& particles);

  /// Begins a new matrix when the last one is in force, adds the next `rows` rows of the membrane to it, and puts it in
  /// force when it is complete: so no step pays for all of it. A hundred steps old it serves as well as new.
  void Refresh(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int rows);

  /// Weights of the membrane's columns, [columns()][stride].
  [[nodiscard]] const float* weights() const { return column_weights_.data(); }
  [[nodiscard]] int columns() const { return columns_; }

  /// Of the residual r: `row_sums` [rows][columns][3] by Kernels::sheet_restrict, tube xyz_ of moving vertices.
  void Solve(const float* row_sums, const float* tube_residual, const float* tube);
  /// The solution on the membrane's rows, [rows][columns][3], for Kernels::sheet_precondition.
  [[nodiscard]] const float* row_values() const { return row_values_.data(); }
  /// tube_z += P y for vertices that move (w of `tube` > 0).
  void Prolong(const float* tube, float* tube_z) const;

 private:
  struct Weights8 {
    std::array<std::uint16_t, 8> node;
    std::array<float, 8> weight;
  };
  struct RowPlace {
    int cell;
    float fraction;
  };
  void AddSheetRow(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int row);
  void AddTube(const ElasticModel& model);
  void AddBindings(const ElasticModel& model, const ParticleStore& particles);
  void Factorise();

  int columns_ = 0, coarse_rows_ = 0, rows_ = 0, stride_ = 0;
  std::uint32_t cols_ = 0;
  GridLayout layout_;
  std::vector<RowPlace> row_place_;
  std::vector<RowPlace> column_place_;
  FloatArray column_weights_;
  std::vector<Weights8> tube_weights_;
  int nodes_ = 0;
  Eigen::MatrixXf constant_, tube_mass_;  ///< Parts that do not change: organ and bindings at rest; mass of the organ.
  Eigen::MatrixXf building_;
  Eigen::LLT<Eigen::MatrixXf> factor_;
  Eigen::VectorXf right_, solution_;
  std::vector<float> row_values_;
  int next_row_ = 0;
};

}  // namespace fulcrum::physics::accurate
