// Dead edges, dead nodes and shrink of the membrane's mesh, derived from the cells.
//
// An edge of the mesh stands for a strand of tissue: the band of cells around its segment in material space. It is dead
// when no connected path of tissue inside that band joins the cells of its two nodes. So a slit far narrower than the
// mesh cuts an edge, and a pin hole in a strand does not. A node is dead when its own cell is removed or it has no live
// edge. Changes are staged and become visible, with a new revision, at Commit().
//
// Cells beyond the border of the sheet are not tissue, and no path leads through them. The exception is a strand that
// has no path without them at rest, because the cells do not resolve an acute corner.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"
#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

inline constexpr float kBandHalfWidth = 0.25f;  ///< Half width of an edge's band, relative to its length.
inline constexpr float kInvalidShrink = 0.7f;   ///< The paper's factor on an edge's rest length per invalid end.
inline constexpr int kShrinkStep = 4;           ///< Shrink is quantised to 4 kShrinkUnit: 0.8 % of the rest length.

/// Half the width of the strand of an edge from a to b, in cells: at least one to either side, so that a diagonal
/// strand is connected.
inline float BandOf(const Vec2f& a, const Vec2f& b) { return std::max(1.0f, kBandHalfWidth * (b - a).norm()); }

/// The published arrays, packed as in the TopologyState message.
struct TopologyBits {
  std::vector<std::uint8_t> dead_nodes, dead_edges, shrink;
};

class MeshTopology {
 public:
  MeshTopology(const SheetScene& scene, const Sheet& sheet);

  /// Re-evaluates every edge whose band touches the box of cells, after cells in it were removed.
  void StageCut(const HeatField& field, CellIndex low, CellIndex high);
  /// Calls take(cell) for each cell of tissue that lies across the middle of the edge's strand: a line of one cell over
  /// the strand's width, through which no path over faces leads. Does nothing for an edge that is dead or does not
  /// exist. Remove the cells, then call StageCut().
  template <class Take>
  void ForCellsAcross(const Sheet& sheet, Index edge, const Take& take) const;
  /// The same along the line from the middle of one edge to that of another.
  template <class Take>
  void ForCellsBetween(const Sheet& sheet, Index edge, Index other, const Take& take) const;
  /// Calls visit(other) for the other edges of the two triangles beside an edge.
  template <class Visit>
  void ForEdgesBeside(Index edge, const Visit& visit) const;
  /// Shrink from collagen damage of the edges near the tile: L = L0 (1 - shrink_max (1 - exp(-Omega))), mean over the
  /// cells of the segment. It is always relative to the rest length and never decreases.
  void StageShrink(const HeatField& field, const Tile& tile);
  /// Applies the paper's rule to a node that has become invalid: the rest length of every edge at it is multiplied by
  /// kInvalidShrink, once per invalid end, and the edges whose other end is `invalid` as well are deleted; a node
  /// without an edge is dead. Call once per node.
  template <class Invalid>
  void StageInvalidNode(Index node, const Invalid& invalid);
  /// Makes staged changes visible. Returns true if there were any; the revision is then one higher.
  bool Commit();

  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  [[nodiscard]] bool staged() const { return changed_; }
  [[nodiscard]] const TopologyBits& committed() const { return committed_; }
  /// True if the edge exists and is alive in the staged state.
  [[nodiscard]] bool EdgeLives(Index edge) const { return EdgeExists(edge) && !TestBit(staged_.dead_edges, edge); }
  [[nodiscard]] std::uint32_t rows() const { return rows_; }
  [[nodiscard]] std::uint32_t cols() const { return cols_; }
  [[nodiscard]] std::uint32_t dead_edge_count() const { return dead_edge_count_; }
  [[nodiscard]] std::uint32_t dead_node_count() const { return dead_node_count_; }

  /// True when arrays of another session fit this mesh: their sizes, nothing set beyond them or where no edge exists,
  /// and no live edge at a dead node.
  [[nodiscard]] bool Fits(const TopologyBits& bits) const;
  /// Restores a checkpoint.
  void Restore(std::uint64_t revision, const TopologyBits& bits);

 private:
  [[nodiscard]] std::span<const Index> EdgesAt(int tile_index) const;
  [[nodiscard]] Index OtherEnd(Index edge) const;
  [[nodiscard]] bool EdgeExists(Index edge) const;
  [[nodiscard]] bool Severed(const HeatField& field, Index edge);
  struct StrandRule {
    bool holes;    ///< Removed cells are closed.
    bool outside;  ///< Cells beyond the border are open.
  };
  [[nodiscard]] bool HasPath(const HeatField& field, Index edge, const StrandRule& rule);
  void KillEdge(Index edge);
  void KillNode(Index node);
  void Shorten(Index edge);
  void KillIfIsolated(Index node);
  void BuildBins(const Sheet& sheet);
  template <class Visit>
  void ForEdgesOfNode(Index node, const Visit& visit) const;

  std::uint32_t rows_, cols_;
  float shrink_max_, cell_m_;
  std::vector<Vec2f> node_;                   ///< Material position in cells from the sheet's origin.
  std::vector<std::uint8_t> exists_;          ///< Bit field over edges.
  std::vector<Index> bin_offset_, bin_edge_;  ///< Edges whose band may touch a tile.
  TopologyBits staged_, committed_;
  bool changed_ = false;
  std::uint64_t revision_ = 0;
  std::uint32_t dead_edge_count_ = 0, dead_node_count_ = 0;

  /// Scratch of the path search.
  std::vector<std::uint8_t> open_;
  std::vector<int> queue_;
};

/// Cells of the sheet whose centre is nearer to the line from p to q than half a cell along the axis that it is steeper
/// to: they join over corners at least, so paths over faces end at them.
template <class Take>
void ForCellsOnLine(const Sheet& sheet, const Vec2f& p, const Vec2f& q, const Take& take) {
  const float length = (q - p).norm();
  const Vec2f along = (q - p) / std::max(length, 1e-6f), across(-along.y(), along.x());
  const float half = 0.5f * std::max(std::abs(along.x()), std::abs(along.y())) + 0.01f;  // 0.01 allows for rounding.
  const Vec2f low = p.cwiseMin(q).array() - 1.0f, high = p.cwiseMax(q).array() + 1.0f;
  for (int iy = std::max(0, static_cast<int>(std::floor(low.y())));
       iy <= std::min(sheet.ny - 1, static_cast<int>(high.y())); ++iy) {
    for (int ix = std::max(0, static_cast<int>(std::floor(low.x())));
         ix <= std::min(sheet.nx - 1, static_cast<int>(high.x())); ++ix) {
      const Vec2f d = Vec2f(static_cast<float>(ix) + 0.5f, static_cast<float>(iy) + 0.5f) - p;
      const float u = d.dot(along);
      if (std::abs(d.dot(across)) > half || u < -0.5f || u > length + 0.5f || sheet.IsOutside(ix, iy)) continue;
      take(CellIndex{ix, iy});
    }
  }
}

template <class Visit>
void MeshTopology::ForEdgesOfNode(Index node, const Visit& visit) const {
  const Index row = node / cols_, col = node % cols_;
  for (Index d = 0; d < 3; ++d) visit(3 * node + d);
  if (col > 0) visit(3 * (node - 1));
  if (row > 0) visit(3 * (node - cols_) + 1);
  if (row > 0 && col > 0) visit(3 * (node - cols_ - 1) + 2);
}

template <class Invalid>
void MeshTopology::StageInvalidNode(Index node, const Invalid& invalid) {
  ForEdgesOfNode(node, [&](Index edge) {
    if (!EdgeExists(edge)) return;
    Shorten(edge);
    if (TestBit(staged_.dead_edges, edge)) return;
    const Index other = edge / 3 == node ? OtherEnd(edge) : edge / 3;
    if (!invalid(other)) return;
    KillEdge(edge);
    KillIfIsolated(other);
  });
  KillIfIsolated(node);
}

template <class Take>
void MeshTopology::ForCellsAcross(const Sheet& sheet, Index edge, const Take& take) const {
  if (!EdgeLives(edge)) return;
  const Vec2f a = node_[edge / 3], b = node_[OtherEnd(edge)], middle = 0.5f * (a + b);
  const Vec2f along = (b - a) / std::max((b - a).norm(), 1e-6f);
  // Half a cell more on either side: the cells of the nodes always belong to the strand, even if their centres lie
  // outside.
  const Vec2f reach = (BandOf(a, b) + 0.5f) * Vec2f(-along.y(), along.x());
  ForCellsOnLine(sheet, middle - reach, middle + reach, take);
}

template <class Take>
void MeshTopology::ForCellsBetween(const Sheet& sheet, Index edge, Index other, const Take& take) const {
  const auto middle = [this](Index e) { return Vec2f(0.5f * (node_[e / 3] + node_[OtherEnd(e)])); };
  ForCellsOnLine(sheet, middle(edge), middle(other), take);
}

template <class Visit>
void MeshTopology::ForEdgesBeside(Index edge, const Visit& visit) const {
  const Index row = edge / 3 / cols_, col = edge / 3 % cols_, direction = edge % 3;
  // Triangles of a cell: (n00, n01, n11) and (n00, n11, n10).
  const auto triangle = [&](Index r, Index c, int half) {
    if (r + 1 >= rows_ || c + 1 >= cols_) return;  //
    const Index n00 = r * cols_ + c, diagonal = 3 * n00 + 2;
    const std::array<Index, 3> edges = half == 0 ? std::array{3 * n00, 3 * (n00 + 1) + 1, diagonal}
                                                 : std::array{3 * (n00 + cols_), 3 * n00 + 1, diagonal};
    for (const Index other : edges) {
      if (other != edge) visit(other);
    }
  };
  if (direction != 1) triangle(row, col, 0);
  if (direction != 0) triangle(row, col, 1);
  if (direction == 0 && row > 0) triangle(row - 1, col, 1);
  if (direction == 1 && col > 0) triangle(row, col - 1, 0);
}

}  // namespace fulcrum::thermal
