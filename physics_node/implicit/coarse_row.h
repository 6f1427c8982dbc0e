// What the edges of one row of the membrane add to the Galerkin matrix of the coarse nodes (coarse_space.cc).
//
//   A_ab += sum over edges (w_a(i) - w_a(j)) (w_b(i) - w_b(j)) K_ij + sum over nodes w_a w_b m s I
//
//   w_a   bilinear function of coarse node a; K_ij stiffness of an edge [N/m]; m mass [kg], s = (1 + damping h) / h^2
//
// An edge leads to the next row at most, and coarse rows stand on rows, so both its ends lie in one cell. There the
// difference of w_a along an edge of one kind is linear in the column's fraction t of the cell, w_a = c_a + s_a t, so
// three moments M_k = sum t^k K of each kind of edge are all that is needed:
//
//   sum w_a w_b K = c_a c_b M_0 + (c_a s_b + s_a c_b) M_1 + s_a s_b M_2
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace fulcrum::physics::implicit {

/// Entries xx yy zz xy xz yz of a symmetric 3 x 3 matrix.
using Symmetric = std::array<float, 6>;
/// Of the four coarse nodes around a cell: by rows, then columns.
using CellWeights = std::array<float, 4>;

class CoarseRow {
 public:
  /// Kinds of contributions: the three directions of edges, and the masses of nodes.
  static constexpr std::size_t kMass = 3, kKinds = 4;

  /// Fractions of the cell: of this row and the next one, and from one column to the next.
  CoarseRow(float row, float next_row, float column_step, Eigen::MatrixXf* matrix)
      : row_(row), next_row_(next_row), column_step_(column_step), matrix_(matrix) {}

  [[nodiscard]] static CellWeights Weights(float row, float column) {
    return {(1 - row) * (1 - column), (1 - row) * column, row * (1 - column), row * column};
  }

  /// Begins a cell. `nodes` around it, -1 where there is none.
  void Begin(const std::array<int, 4>& nodes) { nodes_ = nodes; }
  /// A contribution of a kind at column fraction `t`: an edge with two ends that move, or the mass of a node.
  void Add(std::size_t kind, const Symmetric& element, float t) {
    std::array<Symmetric, 3>& moments = moments_[kind];
    for (std::size_t i = 0; i < element.size(); ++i) {
      moments[0][i] += element[i];
      moments[1][i] += t * element[i];
      moments[2][i] += t * t * element[i];
    }
  }
  /// An edge in direction `d` of which only the end that owns it moves, or only the far one.
  void AddNearEnd(const Symmetric& element, float t) { AddWith(Weights(row_, t), element); }
  void AddFarEnd(std::size_t d, const Symmetric& element, float t) {
    AddWith(Weights(d != 0 ? next_row_ : row_, t + (d != 1 ? column_step_ : 0.0f)), element);
  }
  /// Ends a cell: its sums into the matrix.
  void End() {
    for (std::size_t kind = 0; kind < kKinds; ++kind) {
      AddMoments(kind);
    }
    moments_ = {};
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        const Symmetric& k = a <= b ? sum_[a][b] : sum_[b][a];
        Eigen::Matrix3f block;
        block << k[0], k[3], k[4], k[3], k[1], k[5], k[4], k[5], k[2];
        if (nodes_[a] >= 0 && nodes_[b] >= 0) {
          matrix_->block<3, 3>(3 * nodes_[a], 3 * nodes_[b]) += block;
        }
      }
    }
    sum_ = {};
  }

 private:
  /// Differences of the functions along an edge of a kind at column fraction `t`; of a mass the functions themselves.
  [[nodiscard]] CellWeights Differences(std::size_t kind, float t) const {
    CellWeights w = Weights(row_, t);
    if (kind != kMass) {
      const CellWeights far_end = Weights(kind == 0 ? row_ : next_row_, kind == 1 ? t : t + column_step_);
      for (std::size_t i = 0; i < w.size(); ++i) {
        w[i] -= far_end[i];
      }
    }
    return w;
  }
  void AddMoments(std::size_t kind) {
    const std::array<Symmetric, 3>& moments = moments_[kind];
    const CellWeights constant = Differences(kind, 0), at_end = Differences(kind, 1);
    for (std::size_t a = 0; a < 4; ++a) {
      const float slope_a = at_end[a] - constant[a];
      for (std::size_t b = a; b < 4; ++b) {
        const float slope_b = at_end[b] - constant[b];
        for (std::size_t i = 0; i < 6; ++i) {
          sum_[a][b][i] += constant[a] * constant[b] * moments[0][i] +
                           (constant[a] * slope_b + slope_a * constant[b]) * moments[1][i] +
                           slope_a * slope_b * moments[2][i];
        }
      }
    }
  }
  void AddWith(const CellWeights& w, const Symmetric& element) {
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = a; b < 4; ++b) {
        for (std::size_t i = 0; i < 6; ++i) {
          sum_[a][b][i] += w[a] * w[b] * element[i];
        }
      }
    }
  }

  float row_, next_row_, column_step_;
  Eigen::MatrixXf* matrix_;
  std::array<int, 4> nodes_{};
  std::array<std::array<Symmetric, 3>, kKinds> moments_{};
  std::array<std::array<Symmetric, 4>, 4> sum_{};  ///< By pair of nodes a <= b.
};

}  // namespace fulcrum::physics::implicit
