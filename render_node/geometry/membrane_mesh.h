// Triangle mesh of the membrane with its cuts, for drawing. Pure.
//
// Triangles over a slit are split into parts with ghost corners (services/base/core/slit_sheet.h); each part is drawn
// once.
//
// `side` is +1 at a part's own corners and -1 at its ghosts: the shader discards fragments where it is negative, and
// the atlas defines the slit's border texel by texel.
//
// Crumbs (pieces of a few nodes that are cut off on all sides and have no fixed node) are not drawn: they have shrunk
// to less than a texel of tissue, and their nodes have arbitrary positions in the simulation.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/base/core/slit_sheet.h"

namespace fulcrum::render {

class MembraneMesh {
 public:
  /// Keeps a reference to the arrays of `scene`.
  explicit MembraneMesh(const SceneView& scene);

  /// Sets dead nodes and edges and rebuilds the triangles. Returns false, and changes nothing, if the size of the grid
  /// differs or the bit fields are too short.
  bool SetTopology(const TopologyState& topology);

  /// Positions and normals for these particles (3 * particle count floats, m).
  void Update(std::span<const float> xyz);

  /// Grid nodes first (node = row * cols + col), then three vertices for each part of a cut triangle.
  [[nodiscard]] std::span<const Vec3f> positions() const { return positions_; }
  [[nodiscard]] std::span<const Vec3f> normals() const { return normals_; }
  [[nodiscard]] std::span<const Vec2f> materials() const { return materials_; }  ///< (s, t) [m].
  [[nodiscard]] std::span<const float> sides() const { return sides_; }
  [[nodiscard]] std::span<const Triangle> triangles() const { return triangles_; }
  /// Node of the grid at whose place on the sheet a vertex lies.
  [[nodiscard]] Index NodeOf(Index vertex) const {
    const Index nodes = scene_.membrane.node_count();
    return vertex < nodes ? vertex : parts_[(vertex - nodes) / 3].nodes[(vertex - nodes) % 3];
  }
  /// Number of intact triangles; parts of cut ones follow them in triangles().
  [[nodiscard]] std::size_t whole_triangles() const { return whole_triangles_; }

  /// The grid in blocks of kBlockRows x kBlockCols cells, row by row; the last ones may be smaller.
  static constexpr std::uint32_t kBlockRows = 8, kBlockCols = 4;
  [[nodiscard]] std::uint32_t block_rows() const { return rows_ > 0 ? (rows_ - 1 + kBlockRows - 1) / kBlockRows : 0; }
  [[nodiscard]] std::uint32_t block_cols() const { return cols_ > 0 ? (cols_ - 1 + kBlockCols - 1) / kBlockCols : 0; }
  /// Intact triangles of a block.
  [[nodiscard]] std::span<const Triangle> block_triangles(std::size_t block) const {
    return triangles().subspan(block_start_[block], block_start_[block + 1] - block_start_[block]);
  }
  /// True if no part of the block is cut or removed.
  [[nodiscard]] bool block_intact(std::size_t block) const { return block_intact_[block] != 0; }

  /// True if the node is vaporised, part of a crumb or of no sheet.
  [[nodiscard]] bool node_gone(Index node) const { return gone_[node] != 0; }
  /// True if the edge from the node to the next column (0), row (1) or both (2) is dead. @pre the edge exists.
  [[nodiscard]] bool edge_severed(Index node, std::size_t direction) const {
    return TestBit(dead_edges_, 3 * std::size_t{node} + direction);
  }

 private:
  struct Part {
    Triangle nodes;  // Nodes of the cut triangle.
    OwnedCorners owned;
  };
  /// Adapter of this mesh for SlitSheet.
  struct Held {
    const MembraneMesh& mesh;
    [[nodiscard]] std::uint32_t rows() const { return mesh.rows_; }
    [[nodiscard]] std::uint32_t cols() const { return mesh.cols_; }
    [[nodiscard]] bool Gone(Index node) const { return mesh.node_gone(node); }
    [[nodiscard]] bool Severed(std::size_t edge) const { return TestBit(mesh.dead_edges_, edge); }
    [[nodiscard]] Vec3f Place(Index node) const { return mesh.positions_[node]; }
    [[nodiscard]] Vec3f Rest(Index node) const { return mesh.scene_.rest_position[mesh.scene_.membrane.first + node]; }
    [[nodiscard]] Vec2f Material(Index node) const { return mesh.scene_.membrane_material[node]; }
  };

  void FindGone();
  void BuildTriangles();
  bool AddTriangles(std::uint32_t row, std::uint32_t col);
  void PlaceGoneNodes();

  SceneView scene_;
  std::uint32_t rows_;
  std::uint32_t cols_;
  std::vector<std::uint8_t> dead_nodes_;
  std::vector<std::uint8_t> dead_edges_;
  std::vector<std::uint8_t> absent_, anchored_, gone_;  // Per node.
  std::vector<Index> gone_list_;
  std::vector<Part> parts_;
  std::vector<Vec3f> positions_;
  std::vector<Vec3f> normals_;
  std::vector<Vec2f> materials_;
  std::vector<float> sides_;
  std::vector<Triangle> triangles_;
  std::vector<std::size_t> block_start_;
  std::vector<std::uint8_t> block_intact_;
  std::size_t whole_triangles_ = 0;
};

}  // namespace fulcrum::render
