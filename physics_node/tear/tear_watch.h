// Where traction tears the membrane. Stretch is measured against the rest shape, prestrain included, and smoothed over
// a fixed length of tissue, so that neither its onset nor its place depends on the mesh:
//
//   g = (e_c . e_c, e_c . e_r, e_r . e_r)        metric of a triangle; e_c, e_r its edges along column and row [m^2]
//   C = G^-1 g                                   G: the same at rest; squared stretches are its eigenvalues
//   <g>, <G>: means over the live triangles within kSmoothing along rows and columns of a node
//   lambda = (1 + prestrain) sqrt(largest eigenvalue of <G>^-1 <g>)
//
// An average of right Cauchy-Green tensors: folds and rotations do not enter it. Where lambda reaches the scene's
// tear_stretch, a crack begins at the most stretched place, across the direction of the principal stretch, and runs as
// far as lambda is above kRunsOn of the limit, at most kAdvance to either side. All edges that it crosses are torn. The
// next one begins when these are cut and the tissue has had time to follow. An edge without a live triangle is a thread
// of its own and tears by its own stretch.
//
// Shrinking by heat is not counted as stretch: C is against the shape at rest, as published failure stretches are.
// Torn edges hold until the owner of the topology has severed them (TopologyState).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics_node/tissue/particle_store.h"
#include "physics_node/tissue/tissue_model.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

class TearWatch {
 public:
  /// Half the side of the square of tissue that stretch is averaged over: some ten thicknesses of the sheet; the cells
  /// around a node where these are larger [m].
  static constexpr float kSmoothing_m = 0.002f;
  /// Looks are this far apart [steps]: a crack waits up to five steps for the next commit of the topology anyway.
  static constexpr std::uint64_t kEvery = 2;
  /// Rows far from the limit that have moved, but too little to come near it, are looked at as seldom as Health tells
  /// of them [steps].
  static constexpr std::uint64_t kEveryAll = 10;
  /// Of the limit: from here on stretch is worth a warning, and a crack that has begun runs on.
  static constexpr float kNear = 0.9f;
  /// Of a crack to either side at a time [m]: with a commit every 0.05 s some 0.1 m/s.
  static constexpr float kAdvance_m = 0.005f;
  /// From a change of the topology to the next crack: what a cut has freed must have moved first [steps].
  static constexpr std::uint64_t kRelax = 4;
  /// Longest wait for the topology: for the edges of a crack to be severed, and after a restart for the first
  /// TopologyState, without which an open cut looks like stretch [steps].
  static constexpr std::uint64_t kPatience = 100;

  /// Model and particles must outlive it.
  TearWatch(const SceneView& scene, const TissueModel* model, const ParticleStore* particles);

  /// After TissueModel::Apply: what it has edited.
  void Follow();
  /// Nodes of rows [first, end) of the membrane have moved by at most `moved` [m] since the last call. Look() passes
  /// over rows that have not moved.
  void RowsMoved(std::uint32_t first, std::uint32_t end, float moved);
  /// After each step that moved something. True when edges have torn.
  bool Look(std::uint64_t step);

  /// Edges (3 * node + direction) that have torn since the start: bits as in TearState.
  [[nodiscard]] std::span<const std::uint8_t> torn() const { return torn_; }
  [[nodiscard]] std::uint32_t torn_count() const { return torn_count_; }
  /// lambda at the most stretched place, at the last look.
  [[nodiscard]] float largest_stretch() const { return largest_; }
  /// The largest since the start.
  [[nodiscard]] float largest_stretch_ever() const { return largest_ever_; }
  /// tear_stretch; 0: nothing tears.
  [[nodiscard]] float limit() const { return limit_; }

  /// False when the bits are none of this mesh: it then is as before.
  [[nodiscard]] bool Fits(std::span<const std::uint8_t> torn) const;
  /// @pre Fits(torn), or it is empty: nothing has torn.
  void Restore(std::span<const std::uint8_t> torn);

 private:
  /// Metric in (column, row); of a sum also `weight` triangles.
  struct Metric {
    float cc = 0, cr = 0, rr = 0;
  };
  struct Place {
    float col = 0, row = 0;
  };
  struct Principal {
    float stretch2 = 0;
    Place along;  ///< Direction of the stretch, in columns and rows.
  };
  /// Values of a row of cells: sums over the triangles of a cell, then filtered along the row, by node.
  static constexpr std::size_t kSums = 6;

  [[nodiscard]] static Principal PrincipalOf(const Metric& now, const Metric& rest);
  [[nodiscard]] bool Waits();
  void RefreshTriangle(Index triangle);
  [[nodiscard]] Metric RestMetric(Index triangle) const;
  /// Positions of a row in the order of columns: x, y and z of stride cols.
  const float* RowPlaces(std::uint32_t row);
  float LargestInRow(std::uint32_t row);
  const float* FilteredRow(std::uint32_t row);
  void SmoothRow(std::uint32_t row);
  /// Sums around a node over the window of the average.
  [[nodiscard]] std::array<float, kSums> SumsAt(std::uint32_t row, std::uint32_t col);
  [[nodiscard]] Principal At(std::uint32_t row, std::uint32_t col);
  [[nodiscard]] float StretchAt(const Place& place) const;
  [[nodiscard]] Index OtherEnd(Index edge) const;
  [[nodiscard]] float EdgeStretch2(Index edge) const;
  void TearThreads();
  void Crack(std::uint32_t row, std::uint32_t col);
  void TearAcross(const Place& from, const Place& to);
  void Tear(Index edge);

  SceneView scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  float limit_, to_rest_;  ///< to_rest_: stretch against the rest shape of what is stretched by 1.
  std::uint32_t rows_, cols_;
  /// By half (0: n00 n01 n11, 1: n00 n11 n10) planes over the cells: inverse of the rest metric; 0 where the triangle
  /// is dead, debris, or too thin to say anything.
  std::array<std::vector<float>, 2> inverse_cc_, inverse_cr_, inverse_rr_;
  std::array<std::vector<float>, 2> rest_cc_, rest_cr_, rest_rr_;  ///< The rest metric; 0 likewise.
  float least_area_ = 0;                                           ///< Of a triangle that is looked at [m^2].
  std::vector<float> weight_col_, weight_row_;                     ///< Of the n-th cell beside a node, in the average.
  std::vector<Index> threads_;                                     ///< Edges that may have no live triangle.

  // By row of cells: the largest squared stretch of a triangle at the last look, how far nodes have moved since [m],
  // and how much a movement changes a stretch at most [1/m].
  std::vector<float> row_stretch2_, row_moved_, row_gain_;
  std::vector<float> places_, filtered_, smooth_;  ///< Rows of places, of sums, of lambda by node.
  std::vector<std::uint64_t> places_look_, filtered_look_, smooth_look_;  ///< In which look they were made.
  std::vector<float> line_;                                               ///< Scratch of a row.
  std::uint64_t look_ = 0;

  std::vector<std::uint8_t> torn_;
  std::uint32_t torn_count_ = 0;
  std::vector<Index> waiting_;  ///< Torn and not yet severed.
  std::uint64_t step_ = 0, torn_step_ = 0, quiet_until_ = 0;
  bool followed_ = false, restored_ = false;  ///< Since the last look.
  float largest_ = 0, largest_ever_ = 0;
};

}  // namespace fulcrum::physics
