// Tearing of the membrane by traction. Stretch is measured against the rest shape, prestrain included, and averaged
// over a fixed length of tissue, so that neither onset nor place of a tear depends on the mesh:
//
//   g = (e_c . e_c, e_c . e_r, e_r . e_r)        metric of a triangle; e_c, e_r its edges along column and row [m^2]
//   C = G^-1 g                                   G: the same at rest; squared stretches are its eigenvalues
//   <g>, <G>: means over the living triangles within kSmoothing_m along rows and columns of a node
//   lambda = (1 + prestrain) sqrt(largest eigenvalue of <G>^-1 <g>)
//
// This is an average of right Cauchy-Green tensors, so folds and rotations do not contribute. Where lambda reaches the
// limit of its sheet, a crack begins where it is nearest to its limit, across the direction of the principal stretch,
// and extends as far as lambda exceeds kNear of the limit, at most kAdvance_m to either side. All edges that it crosses
// are torn. The next crack begins after these have been severed and the tissue has moved. An edge without a living
// triangle (a bare edge) tears by its own stretch.
//
// Shrinking by heat is no stretch: C refers to the shape at rest, as published failure stretches do. Torn edges
// transmit forces until the owner of the topology has severed them (TopologyState).
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
  /// Interval of the examinations [steps]: a crack is severed with the next commit of the topology, up to five steps
  /// later.
  static constexpr std::uint64_t kEvery = 2;
  /// Interval for rows that have moved too little to come near the limit [steps]: that of Health, which publishes the
  /// largest stretch.
  static constexpr std::uint64_t kEveryAll = 10;
  /// Share of the limit from which on Health warns, and down to which a crack extends.
  static constexpr float kNear = 0.9f;
  /// Largest advance of a crack to either side at a time [m]: about 0.1 m/s with a commit every 0.05 s.
  static constexpr float kAdvance_m = 0.005f;
  /// Pause from a change of the topology to the next crack [steps]: tissue that a cut has released moves first.
  static constexpr std::uint64_t kRelax = 4;
  /// Longest wait for the topology [steps]: for the edges of a crack to be severed, and after a restart for the first
  /// TopologyState, without which an open cut appears as stretch.
  static constexpr std::uint64_t kMaxWait = 100;

  /// Model and particles must outlive this object.
  TearWatch(const TissueScene& scene, const TissueModel* model, const ParticleStore* particles);

  /// After TissueModel::Apply: updates the triangles of the edited edges.
  void Follow();
  /// Nodes of rows [first, end) of the membrane have moved by at most `moved` [m] since the last call. Evaluate() skips
  /// rows that have not moved.
  void RowsMoved(std::uint32_t first, std::uint32_t end, float moved);
  /// After each step with movement. True if edges have torn.
  bool Evaluate(std::uint64_t step);

  /// Edges (3 * node + direction) that have torn since the start: bits as in TearState.
  [[nodiscard]] std::span<const std::uint8_t> torn() const { return torn_; }
  [[nodiscard]] std::uint32_t torn_count() const { return torn_count_; }
  /// lambda where it is the greatest share of the limit of its sheet, at the last examination; and that limit. Aligned
  /// so that every compiler reads both at once where they are atomic.
  struct alignas(2 * sizeof(float)) Nearest {
    float stretch = 0, limit = 0;
  };
  [[nodiscard]] Nearest nearest() const { return nearest_; }
  /// The largest lambda at the last examination, whatever its limit.
  [[nodiscard]] float largest_stretch() const { return largest_; }
  /// The largest since the start.
  [[nodiscard]] float largest_stretch_ever() const { return largest_ever_; }

  /// False if a bit is set for an edge that this mesh does not have.
  [[nodiscard]] bool Fits(std::span<const std::uint8_t> torn) const;
  /// @pre Fits(torn), or it is empty: nothing has torn.
  void Restore(std::span<const std::uint8_t> torn);

 private:
  /// Metric of a triangle by (column, row) [m^2], or a weighted sum of metrics.
  struct Metric {
    float cc = 0, cr = 0, rr = 0;
  };
  struct Place {
    float col = 0, row = 0;
  };
  struct Principal {
    float stretch2 = 0;
    Place along;  ///< Direction of the stretch in (column, row).
  };
  /// Values of a cell or node in sums of metrics: g (cc, cr, rr), then G.
  static constexpr std::size_t kSums = 6;

  [[nodiscard]] static Principal PrincipalOf(const Metric& now, const Metric& rest);
  [[nodiscard]] bool Paused();
  void RefreshTriangle(Index triangle);
  [[nodiscard]] Metric RestMetric(Index triangle) const;
  /// Positions of a row in the order of its columns: planes x, y and z of `cols` floats.
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
  void TearBareEdges();
  void Crack(std::uint32_t row, std::uint32_t col);
  void TearAcross(const Place& from, const Place& to);
  void Tear(Index edge);

  TissueScene scene_;
  const TissueModel* model_;
  const ParticleStore* particles_;
  float to_rest_;              ///< 1 + prestrain, the stretch in the rest shape.
  std::vector<float> limits_;  ///< By row: tear_stretch of its sheet; empty: nothing tears.
  std::uint32_t rows_, cols_;
  /// By half (0: n00 n01 n11, 1: n00 n11 n10) planes over the cells.
  struct MetricPlanes {
    std::array<std::vector<float>, 2> cc, cr, rr;
  };
  MetricPlanes inverse_;  ///< Inverse of the rest metric [1/m^2]; 0 where the triangle is dead, debris, or below
                          ///< Scale::least_area.
  MetricPlanes rest_;     ///< The rest metric [m^2]; 0 likewise.
  /// Of a sheet, from the size of its cells.
  struct Scale {
    float least_area = 0;                 ///< Least area of a triangle at rest [m^2].
    std::vector<float> by_cols, by_rows;  ///< Weight of the n-th cell beside a node.
  };
  void MeasureSheets();
  std::vector<Scale> scales_;
  std::vector<std::size_t> sheet_of_;  ///< By row.
  std::vector<Index> bare_edges_;      ///< Edges without a living triangle.

  /// By row of cells.
  struct CellRows {
    std::vector<float> stretch2;  ///< Largest squared stretch of a triangle at the last examination.
    std::vector<float> moved;     ///< Movement of nodes since then [m].
    std::vector<float> gain;      ///< Largest change of a stretch per movement [1/m].
  };
  CellRows cell_rows_;
  /// Rows of values, each computed once in an examination at most.
  struct CachedRows {
    std::vector<float> values;
    std::vector<std::uint64_t> pass;  ///< Examination in which a row was computed.
  };
  CachedRows places_, filtered_, smooth_;  ///< Positions, sums, lambda by node.
  std::vector<float> line_;                ///< Scratch of a row.
  std::uint64_t pass_ = 0;                 ///< Number of the examination.

  std::vector<std::uint8_t> torn_;
  std::uint32_t torn_count_ = 0;
  std::vector<Index> pending_;  ///< Torn edges that are not yet severed.
  struct Schedule {
    std::uint64_t step = 0, torn_step = 0, quiet_until = 0;
    bool topology_changed = false, restored = false;  ///< Since the last examination.
  };
  Schedule schedule_;
  Nearest nearest_;
  float largest_ = 0, largest_ever_ = 0;
};

}  // namespace fulcrum::physics
