// The levels above the particles: one product carries a correction over a distance for which sweeps over neighbours
// would take hundreds of iterations. Over the membrane a middle level of every fourth row and column, with blocks of
// its diagonal; over both layers a coarse level of a few dozen nodes, bilinear in the membrane's rows and columns and
// trilinear on a lattice of 30 mm over the organ, with its Galerkin matrix factored (coarse_factor.h).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "physics_node/energy/elastic_model.h"
#include "physics_node/implicit/coarse_factor.h"
#include "physics_node/implicit/elements.h"
#include "physics_node/implicit/kernels.h"
#include "physics_node/implicit/regions.h"
#include "physics_node/implicit/workers.h"
#include "physics_node/tissue/particle_store.h"

namespace fulcrum::physics::implicit {

class CoarseSpace {
 public:
  CoarseSpace(const SceneView& scene, const ElasticModel& model, const ParticleStore& particles,
              const Kernels& kernels);

  /// A new matrix, in force at once.
  void Renew(const Sheet& sheet, const SheetMatrix& matrix, float inertia);
  /// The next part of the next matrix: rows of the membrane, and when it has them all columns of its factor, with the
  /// last of which it is in force. So no step pays for all of it.
  void Refresh(const Sheet& sheet, const SheetMatrix& matrix, float inertia);

  /// The middle level as the kernels see it.
  [[nodiscard]] Middle middle();
  /// Floats of one row in Kernels::sheet_restrict's sums.
  [[nodiscard]] std::size_t row_width() const { return 3 * width_; }

  /// The edge from a node of the sheet in direction `d` is cut or whole again; in force after ScaleBlocks.
  void MarkEdit(std::uint32_t row, std::uint32_t col, std::size_t d);
  /// Blocks are sampled at their centres. Where a cut goes through the samples they are scaled to the edges that are
  /// left to the whole hat; too soft a block would overshoot.
  void ScaleBlocks(const Sheet& sheet);
  /// While not all is computed the coarse nodes rest, and so do middle functions that reach into what is not: cut off
  /// there they would cost far more energy than their blocks say.
  void FollowRegions(const Regions& regions);
  /// While the organ is folded the coarse nodes leave it alone: their matrix knows it as it is at rest, and in folds it
  /// is a hundred times as stiff.
  void LeaveOrganAlone(bool alone) { organ_alone_ = alone; }

  /// Adds a contact's stiffness to the blocks of the middle functions that move it, for this substep: they would ask it
  /// to yield as easily as the sheet.
  void Stiffen(const Element& contact);
  /// After the last of them.
  void FadeAtContacts();
  /// Before a substep's contacts: forgets those of the last one.
  void ForgetContacts();

  /// Middle rows whose centre is one of the sheet's rows [first, end): first and end of them.
  [[nodiscard]] std::pair<int, int> MiddleRows(int first, int end) const;

  /// From the residual of what is computed - `row_sums` [rows][row_width()] by Kernels::sheet_restrict, tube xyz_ - to
  /// Middle::value and the coarse solution.
  void Solve(std::span<const Task> tasks, const float* row_sums, const float* tube_residual, const float* tube,
             Workers* workers);
  /// tube_z += P y for vertices [first, end) that move (w of `tube` > 0). Returns tube_residual . tube_z.
  double Prolong(const float* tube, const float* tube_residual, float* tube_z, int first, int end) const;

 private:
  static constexpr int kSheetColumns = 4;
  /// Of a Refresh. Whole every 60 steps instead of every 30, the errors in a pull are two thirds larger.
  static constexpr int kRefreshRows = 14, kRefreshColumns = 4;
  [[nodiscard]] std::array<std::uint32_t, 2> FunctionsOf(std::uint32_t col) const;
  [[nodiscard]] float Hat(std::uint32_t function, int row, int col) const;
  struct alignas(16) Weights8 {
    std::array<std::uint16_t, 8> node;
    std::array<float, 8> weight;
    bool new_cell = true;  ///< Not in the cell of the vertex before.
  };
  struct RowPlace {
    int cell;
    float fraction;
  };
  void AddRows(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int rows);
  void AddSheetRow(const Sheet& sheet, const SheetMatrix& matrix, float inertia, int row);
  void AddTube(const ElasticModel& model);
  void AddBindings(const ElasticModel& model, const ParticleStore& particles);
  void BuildMiddle();
  void RestrictTube(int first, int end, const float* tube_residual, const float* tube);
  void SumRows(std::span<const Task> tasks, const float* row_sums);
  void RestrictMiddle();
  /// Of middle rows [first, end).
  void ProlongMiddle(int first, int end);

  const Kernels& kernels_;
  int columns_ = 0, coarse_rows_ = 0, rows_ = 0, stride_ = 0;
  std::size_t tube_floats_;
  std::uint32_t cols_ = 0;
  GridLayout layout_;
  std::vector<RowPlace> row_place_;
  std::vector<RowPlace> column_place_;

  // The middle level.
  int middle_rows_ = 0, middle_slots_ = 0;
  std::size_t width_ = 0;  ///< Floats of a plane of its row.
  std::vector<int> centre_, cell_;
  std::vector<std::uint8_t> middle_rests_;  ///< By middle row.
  bool coarse_rests_ = false, organ_alone_ = false;
  std::vector<float> yields_;                        ///< By middle function: 0 where a contact holds it, else 1.
  std::vector<std::pair<std::size_t, float>> held_;  ///< Functions that do not yield.
  std::vector<float> fraction_;
  FloatArray own_, next_, scale_;
  std::vector<std::uint32_t> edited_;  ///< Middle functions.
  std::array<FloatArray, 6> block_;
  FloatArray residual_, value_;
  FloatArray column_share_;  ///< [columns_][width_], part of a coarse column in a float of the middle level's row.

  std::vector<Weights8> tube_weights_;
  int nodes_ = 0;
  Eigen::MatrixXf constant_, tube_mass_;  ///< Parts that do not change: organ and bindings at rest; mass of the organ.
  Eigen::MatrixXf building_;
  CoarseFactor factor_;
  FloatArray nodes4_;       ///< Right side, then solution, xyz_ per coarse node.
  FloatArray tube_nodes4_;  ///< What the organ gives to the right side.
  int next_row_ = 0;        ///< Of building_.
  bool complete_ = false;   ///< building_ waits to be factored.
};

}  // namespace fulcrum::physics::implicit
