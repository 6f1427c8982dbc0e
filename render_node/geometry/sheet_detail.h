// Level of detail of the membrane. A software rasteriser shades blocks of 4 x 4 pixels: where the sheet is smooth and
// intact, triangles of a few pixels cost several times as much as large ones and look the same. Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render_node/geometry/membrane_mesh.h"

namespace fulcrum::render {

/// Triangles in the order of drawing, in runs that are shaded alike: run k ends before triangle ends[k], where the next
/// one begins. Runs 0, 2, … are of untouched blocks, the others of touched ones; the first may be empty.
struct SheetRuns {
  std::vector<Triangle> triangles;
  std::vector<std::size_t> ends;
};

class SheetDetail {
 public:
  explicit SheetDetail(const MembraneGrid& grid);

  /// Replaces `out` by the triangles to draw: per block of the grid the coarsest division whose positions differ from
  /// the fine one by less than half a pixel and whose normals differ by less than 0.15. Cut blocks and their neighbours
  /// keep the finest division. There are no gaps between blocks. Rows far from the eye come first, so that in a fold
  /// the near layer is blended over the far one; then the parts of cut triangles, as touched.
  ///
  /// @param untouched       Per block of the mesh: not 0 where an intact block is untouched.
  /// @param eye_W           Place of the eye [m].
  /// @param pixels_per_rad  Of the picture, in its middle.
  void Choose(const MembraneMesh& membrane, const Vec3f& eye_W, float pixels_per_rad,
              std::span<const std::uint8_t> untouched, SheetRuns* out);

  /// visit(node) for each node of a block.
  template <class Visit>
  void ForEachNode(std::size_t block, const Visit& visit) const {
    const auto cols = (grid_.cols - 1 + MembraneMesh::kBlockCols - 1) / MembraneMesh::kBlockCols;
    const Block nodes = BlockAt(static_cast<std::uint32_t>(block) / cols, static_cast<std::uint32_t>(block) % cols);
    for (std::uint32_t row = nodes.row; row <= nodes.row_end; ++row) {
      for (std::uint32_t col = nodes.col; col <= nodes.col_end; ++col) visit(row * grid_.cols + col);
    }
  }

  /// Nodes of a block: [row, row_end] x [col, col_end].
  struct Block {
    std::uint32_t row, row_end, col, col_end;
  };

 private:
  [[nodiscard]] Block BlockAt(std::uint32_t row, std::uint32_t col) const;
  [[nodiscard]] bool BesideCut(const MembraneMesh& membrane, std::uint32_t row, std::uint32_t col) const;
  void ChooseLevels(const MembraneMesh& membrane, const Vec3f& eye_W, float pixels_per_rad);
  void AppendBlock(const MembraneMesh& membrane, std::uint32_t row, std::uint32_t col,
                   std::vector<Triangle>* out) const;

  MembraneGrid grid_;
  std::vector<std::uint8_t> levels_;  // Per block: index of its division, 0 is the finest.
};

}  // namespace fulcrum::render
