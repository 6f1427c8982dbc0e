#include "render_node/geometry/membrane_mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "render_node/geometry/surface.h"

namespace fulcrum::render {
namespace {

struct Neighbour {
  int row, col;
};
// Direction d of a TopologyState edge, seen from its first node.
constexpr std::array<Neighbour, 3> kDirections{{{0, 1}, {1, 0}, {1, 1}}};

// Pieces below this size are crumbs: some 30 mm^2 of the built-in sheet.
constexpr std::size_t kCrumbNodes = 40;

}  // namespace

MembraneTriangle MembraneTriangleAt(std::uint32_t cols, std::uint32_t row, std::uint32_t col, int half) {
  const Index n00 = row * cols + col;
  const Index n01 = n00 + 1, n10 = n00 + cols, n11 = n10 + 1;
  const auto edge = [](Index node, std::size_t direction) { return 3 * std::size_t{node} + direction; };
  if (half == 0) {
    return {{n00, n01, n11}, {edge(n00, 0), edge(n01, 1), edge(n00, 2)}};
  }
  return {{n00, n11, n10}, {edge(n00, 2), edge(n10, 0), edge(n00, 1)}};
}

template <class Visit>
void MembraneMesh::ForEachNeighbour(Index node, const Visit& visit) const {
  const auto row = static_cast<int>(node / cols_), col = static_cast<int>(node % cols_);
  const auto inside = [this](int r, int c) {
    return r >= 0 && c >= 0 && r < static_cast<int>(rows_) && c < static_cast<int>(cols_);
  };
  for (std::size_t d = 0; d < 3; ++d) {
    const auto [dr, dc] = kDirections[d];
    if (inside(row + dr, col + dc)) {
      visit(static_cast<Index>(row + dr) * cols_ + static_cast<Index>(col + dc), 3 * std::size_t{node} + d);
    }
    if (inside(row - dr, col - dc)) {
      const Index other = static_cast<Index>(row - dr) * cols_ + static_cast<Index>(col - dc);
      visit(other, 3 * std::size_t{other} + d);
    }
  }
}

MembraneMesh::MembraneMesh(const SceneView& scene)
    : scene_(scene), rows_(scene.membrane.rows), cols_(scene.membrane.cols) {
  const std::size_t nodes = scene.membrane.node_count();
  dead_nodes_.assign((nodes + 7) / 8, 0);
  dead_edges_.assign((3 * nodes + 7) / 8, 0);
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

// Flood fill over live edges; a piece is a crumb when it is small and none of its nodes is fixed.
void MembraneMesh::FindGone() {
  const Index nodes = scene_.membrane.node_count();
  gone_list_.clear();
  gone_.assign(nodes, 0);
  std::vector<std::uint8_t> seen(nodes, 0);
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
      fixed = fixed || scene_.inverse_mass[scene_.membrane.first + node] == 0;
      ForEachNeighbour(node, [&](Index other, std::size_t edge) {
        if (!seen[other] && !edge_dead(edge) && !TestBit(dead_nodes_, other)) {
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
      sides_[first + k] = (parts_[p].owned >> k) & 1 ? 1.0f : -1.0f;
    }
    triangles_.push_back({first, first + 1, first + 2});
  }
}

// True when both triangles of the cell are as they were made.
bool MembraneMesh::AddTriangles(std::uint32_t row, std::uint32_t col) {
  bool intact = true;
  for (int half = 0; half < 2; ++half) {
    const MembraneTriangle t = MembraneTriangleAt(cols_, row, col, half);
    std::array<bool, 3> alive;
    int dead = 0;
    for (int k = 0; k < 3; ++k) {
      const Index a = t.nodes[k], b = t.nodes[(k + 1) % 3];
      alive[k] = !edge_dead(t.edges[k]) && !node_gone(a) && !node_gone(b);
      dead += alive[k] ? 0 : 1;
    }
    intact = intact && dead == 0;
    // One dead edge leaves the corners joined: the slit ends inside, and the atlas shows how far it goes.
    if (dead < 2) {
      triangles_.push_back(t.nodes);
    } else {
      AddParts(t.nodes, alive);
    }
  }
  return intact;
}

// With two or three dead edges a corner is joined to another one only through the edge that lives, if any.
void MembraneMesh::AddParts(const Triangle& nodes, const std::array<bool, 3>& edge_alive) {
  std::uint8_t taken = 0;
  for (int k = 0; k < 3; ++k) {
    if (edge_alive[k]) {
      const auto owned = static_cast<std::uint8_t>((1u << k) | (1u << ((k + 1) % 3)));
      parts_.push_back({nodes, owned});
      taken = owned;
    }
  }
  for (int k = 0; k < 3; ++k) {
    if (!((taken >> k) & 1) && !node_gone(nodes[k])) {
      parts_.push_back({nodes, static_cast<std::uint8_t>(1u << k)});
    }
  }
}

void MembraneMesh::Update(std::span<const float> xyz) {
  const std::size_t nodes = scene_.membrane.node_count();
  for (std::size_t node = 0; node < nodes; ++node) {
    positions_[node] = PositionOf(xyz, scene_.membrane.first + static_cast<Index>(node));
  }
  PlaceGoneNodes();
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Part& part = parts_[p];
    const int owners = std::popcount(part.owned);
    for (int k = 0; k < 3; ++k) {
      Vec3f& position = positions_[nodes + 3 * p + static_cast<std::size_t>(k)];
      if ((part.owned >> k) & 1) {
        position = positions_[part.nodes[k]];
        continue;
      }
      position = Vec3f::Zero();
      for (int j = 0; j < 3; ++j) {
        if ((part.owned >> j) & 1) {
          position += GhostFrom(part.nodes[j], part.nodes[k]) / static_cast<float>(owners);
        }
      }
    }
  }
  ComputeNormals(positions_, std::span(triangles_).first(whole_triangles_), normals_);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Part& part = parts_[p];
    Vec3f mean = Vec3f::Zero();
    for (int k = 0; k < 3; ++k) {
      if ((part.owned >> k) & 1) {
        mean += normals_[part.nodes[k]];
      }
    }
    // A corner cut off on every side has no whole triangle to take a normal from.
    const Vec3f* corner = &positions_[nodes + 3 * p];
    const Vec3f normal =
        mean.squaredNorm() > 0 ? mean.normalized() : (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      normals_[nodes + 3 * p + k] = (part.owned >> k) & 1 && mean.squaredNorm() > 0 ? normals_[part.nodes[k]] : normal;
    }
  }
}

// Least squares over the live edges at the node: dx = ds * Ds + dt * Dt.
MembraneMesh::Frame MembraneMesh::FrameAt(Index node) const {
  Eigen::Matrix2f normal_matrix = Eigen::Matrix2f::Zero();
  Eigen::Matrix<float, 3, 2> moment = Eigen::Matrix<float, 3, 2>::Zero();
  ForEachNeighbour(node, [&](Index other, std::size_t edge) {
    if (!edge_dead(edge) && !node_gone(other)) {
      const Vec2f dm = scene_.membrane_material[other] - scene_.membrane_material[node];
      normal_matrix += dm * dm.transpose();
      moment += (positions_[other] - positions_[node]) * dm.transpose();
    }
  });
  // Two edges in nearly one line say nothing about the other direction: below 1 % of a right angle's determinant.
  const float trace = normal_matrix.trace();
  if (normal_matrix.determinant() <= 0.01f * trace * trace / 4) {
    return {Vec3f::Zero(), Vec3f::Zero(), false};
  }
  const Eigen::Matrix<float, 3, 2> frame = moment * normal_matrix.inverse();
  return {frame.col(0), frame.col(1), true};
}

Vec3f MembraneMesh::GhostFrom(Index owner, Index ghost) const {
  const Frame frame = FrameAt(owner);
  if (!frame.valid) {
    const Index first = scene_.membrane.first;
    return positions_[owner] + scene_.rest_position[first + ghost] - scene_.rest_position[first + owner];
  }
  const Vec2f dm = scene_.membrane_material[ghost] - scene_.membrane_material[owner];
  // Unstretched: the free edge of a slit has let go of its tension.
  const float ds = std::max(1.0f, frame.ds.norm()), dt = std::max(1.0f, frame.dt.norm());
  return positions_[owner] + frame.ds * (dm.x() / ds) + frame.dt * (dm.y() / dt);
}

// A vaporised node has no constraints left and may be anywhere: the fat beneath and the picture need a quiet place.
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
