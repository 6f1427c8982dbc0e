#include "render_node/geometry/membrane_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render_node/geometry/surface.h"
#include "services/base/core/sheets.h"

namespace fulcrum::render {

MembraneMesh::MembraneMesh(const SceneView& scene)
    : scene_(scene), rows_(scene.membrane.rows), cols_(scene.membrane.cols) {
  const std::size_t nodes = scene.membrane.node_count();
  dead_nodes_.assign((nodes + 7) / 8, 0);
  dead_edges_.assign((3 * nodes + 7) / 8, 0);
  absent_ = AbsentNodes(scene);
  anchored_.assign(nodes, 0);
  for (const Binding& binding : scene.bindings) {
    anchored_[binding.membrane - scene.membrane.first] = 1;
  }
  BuildTriangles();
}

bool MembraneMesh::SetTopology(const TopologyState& topology) {
  if (topology.rows != rows_ || topology.cols != cols_ || topology.dead_nodes.size() < dead_nodes_.size() ||
      topology.dead_edges.size() < dead_edges_.size()) {
    return false;
  }
  std::copy_n(topology.dead_nodes.begin(), dead_nodes_.size(), dead_nodes_.begin());
  std::copy_n(topology.dead_edges.begin(), dead_edges_.size(), dead_edges_.begin());
  BuildTriangles();
  return true;
}

// Flood fill over live edges; a piece is a crumb if it is small and none of its nodes is fixed or bound. What bindings
// hold physics computes, tools touch and current heats.
void MembraneMesh::FindGone() {
  const Index nodes = scene_.membrane.node_count();
  const Held held{*this};
  const SlitSheet sheet(held);
  gone_list_.clear();
  gone_ = absent_;
  std::vector<std::uint8_t> seen = absent_;
  std::vector<Index> piece;
  for (Index start = 0; start < nodes; ++start) {
    if (TestBit(dead_nodes_, start)) {
      gone_[start] = 1;
      gone_list_.push_back(start);
      continue;
    }
    if (seen[start]) {
      continue;
    }
    piece.assign(1, start);
    seen[start] = 1;
    bool fixed = false;
    for (std::size_t k = 0; k < piece.size(); ++k) {
      const Index node = piece[k];
      fixed = fixed || anchored_[node] != 0 || scene_.inverse_mass[scene_.membrane.first + node] == 0;
      sheet.ForEachNeighbour(node, [&](Index other, std::size_t edge) {
        if (!seen[other] && !TestBit(dead_edges_, edge) && !TestBit(dead_nodes_, other)) {
          seen[other] = 1;
          piece.push_back(other);
        }
      });
    }
    if (!fixed && piece.size() < kCrumbNodes) {
      for (const Index node : piece) {
        gone_[node] = 1;
        gone_list_.push_back(node);
      }
    }
  }
}

void MembraneMesh::BuildTriangles() {
  triangles_.clear();
  parts_.clear();
  FindGone();
  block_start_.clear();
  block_intact_.clear();
  for (std::uint32_t block_row = 0; block_row < block_rows(); ++block_row) {
    for (std::uint32_t block_col = 0; block_col < block_cols(); ++block_col) {
      block_start_.push_back(triangles_.size());
      bool intact = true;
      for (std::uint32_t r = block_row * kBlockRows; r < std::min((block_row + 1) * kBlockRows, rows_ - 1); ++r) {
        for (std::uint32_t c = block_col * kBlockCols; c < std::min((block_col + 1) * kBlockCols, cols_ - 1); ++c) {
          intact = AddTriangles(r, c) && intact;
        }
      }
      block_intact_.push_back(intact ? 1 : 0);
    }
  }
  block_start_.push_back(triangles_.size());
  whole_triangles_ = triangles_.size();
  const std::size_t nodes = scene_.membrane.node_count();
  const std::size_t vertices = nodes + 3 * parts_.size();
  positions_.resize(vertices, Vec3f::Zero());
  normals_.resize(vertices, Vec3f::Zero());
  materials_.resize(vertices);
  sides_.resize(vertices);
  std::copy_n(scene_.membrane_material.begin(), nodes, materials_.begin());
  std::fill_n(sides_.begin(), nodes, 1.0f);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Index first = static_cast<Index>(nodes + 3 * p);
    for (Index k = 0; k < 3; ++k) {
      materials_[first + k] = scene_.membrane_material[parts_[p].nodes[k]];
      sides_[first + k] = Owns(parts_[p].owned, k) ? 1.0f : -1.0f;
    }
    triangles_.push_back({first, first + 1, first + 2});
  }
}

// Returns true if both triangles of the cell exist and are intact.
bool MembraneMesh::AddTriangles(std::uint32_t row, std::uint32_t col) {
  if (!HasCell(scene_, row, col)) return false;
  const Held held{*this};
  const SlitSheet sheet(held);
  bool intact = true;
  for (int half = 0; half < 2; ++half) {
    const MembraneTriangle t = MembraneTriangleAt(cols_, row, col, half);
    for (std::size_t k = 0; k < 3; ++k) {
      intact = intact && !TestBit(dead_edges_, t.edges[k]) && !node_gone(t.nodes[k]);
    }
    const TriangleParts parts = sheet.Parts(t);
    for (std::size_t i = 0; i < parts.count; ++i) {
      if (parts.owned[i] == kAllCorners) {
        triangles_.push_back(t.nodes);
      } else {
        parts_.push_back({t.nodes, parts.owned[i]});
      }
    }
  }
  return intact;
}

void MembraneMesh::Update(std::span<const float> xyz) {
  const std::size_t nodes = scene_.membrane.node_count();
  for (std::size_t node = 0; node < nodes; ++node) {
    positions_[node] = PositionOf(xyz, scene_.membrane.first + static_cast<Index>(node));
  }
  PlaceGoneNodes();
  const Held held{*this};
  const SlitSheet sheet(held);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const auto corners = sheet.Corners(parts_[p].nodes, parts_[p].owned);
    std::copy(corners.begin(), corners.end(), positions_.begin() + static_cast<std::ptrdiff_t>(nodes + 3 * p));
  }
  ComputeNormals(positions_, std::span(triangles_).first(whole_triangles_), normals_);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Part& part = parts_[p];
    Vec3f mean = Vec3f::Zero();
    for (int k = 0; k < 3; ++k) {
      if (Owns(part.owned, static_cast<std::size_t>(k))) {
        mean += normals_[part.nodes[k]];
      }
    }
    // A corner that is cut off on all sides has no intact triangle for its normal.
    const Vec3f* corner = &positions_[nodes + 3 * p];
    const Vec3f normal =
        mean.squaredNorm() > 0 ? mean.normalized() : (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      normals_[nodes + 3 * p + k] = Owns(part.owned, k) && mean.squaredNorm() > 0 ? normals_[part.nodes[k]] : normal;
    }
  }
}

// A vaporised node has no constraints and may be anywhere, so it is given a well-defined place for the fat beneath and
// the picture.
void MembraneMesh::PlaceGoneNodes() {
  const Index first = scene_.membrane.first;
  for (const Index node : gone_list_) {
    const int row = static_cast<int>(node / cols_), col = static_cast<int>(node % cols_);
    Vec3f sum = Vec3f::Zero();
    int count = 0;
    for (int r = std::max(0, row - 2); r <= std::min(static_cast<int>(rows_) - 1, row + 2); ++r) {
      for (int c = std::max(0, col - 2); c <= std::min(static_cast<int>(cols_) - 1, col + 2); ++c) {
        const Index other = static_cast<Index>(r) * cols_ + static_cast<Index>(c);
        if (!node_gone(other)) {
          sum += positions_[other] + scene_.rest_position[first + node] - scene_.rest_position[first + other];
          ++count;
        }
      }
    }
    positions_[node] = count > 0 ? Vec3f(sum / static_cast<float>(count)) : scene_.rest_position[first + node];
  }
}

}  // namespace fulcrum::render
