// Checks after each commit that the topology refers to no dead element and agrees with the cells.
#pragma once

#include <string>
#include <vector>

#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::thermal {

/// Checks one solver from commit to commit.
///
/// The rules:
///  - arrays have the mesh's sizes and nothing is set beyond them or where no edge exists,
///  - counts agree with the bits,
///  - no live edge ends at a dead node, and a node is dead if and only if its own cell is removed or no edge is left,
///  - an edge is dead if and only if its strand is severed, recomputed from the cells,
///  - revisions and shrink never decrease and no dead element becomes alive again.
class TopologyValidator {
 public:
  TopologyValidator(const SceneView& scene, const Sheet& sheet);

  /// Call when nothing is staged. Returns a readable description of the first violated rule; empty when all hold.
  [[nodiscard]] std::string Check(const MeshTopology& topology, const HeatField& field);
  /// Check() after a Step, if nothing is staged.
  [[nodiscard]] std::string Check(const ThermalSolver& solver) {
    return solver.topology().staged() ? std::string() : Check(solver.topology(), solver.field());
  }

 private:
  struct Edge {
    std::size_t index;
    Index a, b;
  };
  [[nodiscard]] std::string CheckEdge(const Edge& edge, const TopologyBits& bits, const HeatField& field) const;
  [[nodiscard]] std::string CheckNode(Index node, bool attached, const TopologyBits& bits,
                                      const HeatField& field) const;
  [[nodiscard]] std::string CheckHistory(const MeshTopology& topology) const;
  void FindHoles(const HeatField& field);
  /// False when no tile under the strand has a hole, so that nothing needs to be recomputed.
  [[nodiscard]] bool NearHole(const Edge& edge, const Sheet& sheet) const;
  /// True when tissue cells within the strand join the cells of its nodes.
  [[nodiscard]] bool Joined(const Edge& edge, const HeatField& field, bool holes, bool outside) const;
  [[nodiscard]] CellIndex CellOfNode(Index node, const Sheet& sheet) const;

  std::size_t nodes_;
  std::vector<std::uint8_t> absent_;  ///< By node: 1 where it belongs to no sheet; those are not checked.
  std::vector<Edge> edges_;           ///< Existing edges.
  std::vector<Vec2f> node_;           ///< Positions in cells from the sheet's origin.
  std::vector<bool> hole_;            ///< Per tile, at the present Check().
  TopologyBits last_;
  std::uint64_t last_revision_ = 0;
};

/// True when the cell was removed.
[[nodiscard]] bool IsRemoved(const HeatField& field, CellIndex cell);

}  // namespace fulcrum::thermal
