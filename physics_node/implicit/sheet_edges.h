// The edges and triangles of the membrane as cuts and heat have left them, and the nodes that cuts have frayed.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics_node/implicit/implicit_model.h"
#include "physics_node/tissue/tissue_model.h"

namespace fulcrum::physics::implicit {

/// An edge at a frayed node.
struct FrayedEdge {
  std::size_t direction;
  std::array<std::uint32_t, 2> at;  ///< Ends, by place in a plane.
  float stiffness;                  ///< At least, in the matrix, in every direction [N/m].
};

class SheetEdges {
 public:
  /// `model` must outlive this.
  SheetEdges(const ImplicitModel& model, const TissueModel& tissue);

  /// The edge from a node in a direction is cut, whole again, or has shrunk.
  void Update(const TissueModel& tissue, Index row, Index col, std::size_t direction);
  /// After the last Update.
  void FindFrayed();

  /// The membrane as the kernels read it; `inverse_mass` is a plane.
  [[nodiscard]] Sheet View(const float* inverse_mass) const;
  /// Nodes that have lost half of their edges or more, and the edges that they have left.
  [[nodiscard]] std::span<const ParticleRef> frayed_nodes() const { return frayed_nodes_; }
  [[nodiscard]] std::span<const FrayedEdge> frayed_edges() const { return frayed_edges_; }

 private:
  /// A triangle of a cell.
  struct TrianglePlace {
    Index row, col;
    std::size_t half;
  };
  [[nodiscard]] std::array<std::optional<TrianglePlace>, 2> TrianglesOf(Index row, Index col,
                                                                        std::size_t direction) const;
  /// From its three edges; then what these carry as springs.
  void UpdateTriangle(const TrianglePlace& triangle);
  void UpdateSpring(Index row, Index col, std::size_t direction);

  const ImplicitModel& model_;
  std::array<FloatArray, 3> axial_, inverse_rest_;  ///< Sheet::whole and inverse_rest.
  // Of model continuum alone, as in Sheet.
  std::array<FloatArray, 3> spring_;
  std::array<FloatArray, 2> triangle_;
  std::array<std::array<FloatArray, 3>, 2> trace_;
  std::vector<int> springs_in_row_;
  std::vector<int> missing_;  ///< By place in a plane: edges that a node has lost to cuts.
  std::vector<ParticleRef> frayed_nodes_;
  std::vector<FrayedEdge> frayed_edges_;
};

}  // namespace fulcrum::physics::implicit
