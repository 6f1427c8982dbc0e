// The membrane's grid as it lies in space, with its slits.
//
// The simulation keeps one grid of nodes, also across a cut: only the edges over the slit are dead. A triangle over the
// slit has no defined shape in this grid; if it were drawn as it is, it would stretch over the opening slit. Therefore
// such a triangle is divided into one part for each piece that its dead edges leave. A part keeps its own corners and
// gets ghosts for the others, placed where the membrane would be if it continued unstretched:
//
//         a───────b        dead edges a-c, b-c:                 a───────b
//          \     /         part {a, b} with ghost c'    and      \ {ab}/       c
//     ══════\═══/══ cut    part {c} with ghosts a', b'            ·---·   a'·-/{c}\-·b'
//            \ /
//             c
//
// Physics (the footprint of the metal), the picture and the map of a recording use the same parts.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstdint>

#include "services/base/core/types.h"

namespace fulcrum {

/// Pieces of sheet with fewer nodes that are neither fixed nor bound are crumbs, about 30 mm^2 of the built-in sheet:
/// physics freezes them and the picture does not show them. All that is shown can be touched.
inline constexpr std::size_t kCrumbNodes = 40;

/// Corners and edges of membrane triangle 2 * cell + half (numbering of CauteryContact and TopologyState).
struct MembraneTriangle {
  Triangle nodes;
  std::array<std::size_t, 3> edges;  ///< Between corners (0, 1), (1, 2), (2, 0).
};
[[nodiscard]] inline MembraneTriangle MembraneTriangleAt(std::uint32_t cols, std::uint32_t row, std::uint32_t col,
                                                         int half) {
  const Index n00 = row * cols + col;
  const Index n01 = n00 + 1, n10 = n00 + cols, n11 = n10 + 1;
  const auto edge = [](Index node, std::size_t direction) { return 3 * std::size_t{node} + direction; };
  if (half == 0) {
    return {{n00, n01, n11}, {edge(n00, 0), edge(n01, 1), edge(n00, 2)}};
  }
  return {{n00, n11, n10}, {edge(n00, 2), edge(n10, 0), edge(n00, 1)}};
}

/// As above, by the triangle's number.
[[nodiscard]] inline MembraneTriangle MembraneTriangleAt(std::uint32_t cols, Index triangle) {
  const Index cell = triangle / 2;
  return MembraneTriangleAt(cols, cell / (cols - 1), cell % (cols - 1), static_cast<int>(triangle % 2));
}

/// Corners of a part of a cut triangle: a bit for each corner that belongs to it; the others are ghosts.
using OwnedCorners = std::uint8_t;
inline constexpr OwnedCorners kAllCorners = 7;
[[nodiscard]] inline bool Owns(OwnedCorners part, std::size_t corner) { return ((part >> corner) & 1) != 0; }

/// The parts of a triangle, determined by its live edges and its missing corners; at most three.
struct TriangleParts {
  std::array<OwnedCorners, 3> owned{};
  std::size_t count = 0;

  /// Whether the point belongs to the part. A point belongs to the part whose own corners have the largest total
  /// weight there; on a border to both parts.
  [[nodiscard]] bool IsOf(std::size_t part, const std::array<float, 3>& barycentric) const {
    const auto share = [&](OwnedCorners corners) {
      float sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += Owns(corners, k) ? barycentric[k] : 0.0f;
      return sum;
    };
    const float own = share(owned[part]);
    for (std::size_t i = 0; i < count; ++i) {
      if (share(owned[i]) > own) return false;
    }
    return true;
  }
};
[[nodiscard]] inline TriangleParts PartsOf(const std::array<bool, 3>& edge_alive, const std::array<bool, 3>& gone) {
  TriangleParts parts;
  // With one dead edge the corners stay connected: the slit ends inside.
  if (edge_alive[0] + edge_alive[1] + edge_alive[2] >= 2) {
    parts.owned[parts.count++] = kAllCorners;
    return parts;
  }
  // Otherwise a corner is connected to another one only by the live edge, if there is one.
  OwnedCorners taken = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (edge_alive[k]) {
      taken = static_cast<OwnedCorners>((1u << k) | (1u << ((k + 1) % 3)));
      parts.owned[parts.count++] = taken;
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    if (!Owns(taken, k) && !gone[k]) parts.owned[parts.count++] = static_cast<OwnedCorners>(1u << k);
  }
  return parts;
}

/// Parts and ghosts of a membrane that is stored in a `Holder`, which has
///   std::uint32_t rows() const, cols() const;
///   bool Gone(Index node) const;                 vaporised, or part of a crumb
///   bool Severed(std::size_t edge) const;        3 * node + direction
///   Vec3f Place(Index node) const;               of a node that is not gone, frame W [m]
///   Vec3f Rest(Index node) const;                at rest [m]
///   Vec2f Material(Index node) const;            (s, t) [m]
template <class Holder>
class SlitSheet {
 public:
  explicit SlitSheet(const Holder& holder) : holder_(holder) {}

  /// visit(other node, edge between the two) for the up to six neighbours in the grid.
  template <class Visit>
  void ForEachNeighbour(Index node, const Visit& visit) const {
    constexpr std::array<std::array<int, 2>, 3> kDirections{{{0, 1}, {1, 0}, {1, 1}}};
    const auto rows = static_cast<int>(holder_.rows()), cols = static_cast<int>(holder_.cols());
    const int row = static_cast<int>(node) / cols, col = static_cast<int>(node) % cols;
    const auto inside = [&](int r, int c) { return r >= 0 && c >= 0 && r < rows && c < cols; };
    for (std::size_t d = 0; d < 3; ++d) {
      const auto [dr, dc] = kDirections[d];
      if (inside(row + dr, col + dc)) {
        visit(static_cast<Index>((row + dr) * cols + col + dc), 3 * std::size_t{node} + d);
      }
      if (inside(row - dr, col - dc)) {
        const auto other = static_cast<Index>((row - dr) * cols + col - dc);
        visit(other, 3 * std::size_t{other} + d);
      }
    }
  }

  [[nodiscard]] TriangleParts Parts(const MembraneTriangle& t) const {
    std::array<bool, 3> alive{}, gone{};
    for (std::size_t k = 0; k < 3; ++k) gone[k] = holder_.Gone(t.nodes[k]);
    for (std::size_t k = 0; k < 3; ++k) alive[k] = !gone[k] && !gone[(k + 1) % 3] && !holder_.Severed(t.edges[k]);
    return PartsOf(alive, gone);
  }

  /// Places of the corners of a part, ghosts included [m].
  [[nodiscard]] std::array<Vec3f, 3> Corners(const Triangle& nodes, OwnedCorners owned) const {
    std::array<Vec3f, 3> place;
    for (std::size_t k = 0; k < 3; ++k) {
      if (Owns(owned, k)) {
        place[k] = holder_.Place(nodes[k]);
        continue;
      }
      place[k].setZero();
      float owners = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        if (!Owns(owned, j)) continue;
        place[k] += Ghost(nodes[j], nodes[k]);
        ++owners;
      }
      place[k] /= owners;
    }
    return place;
  }

  /// Position of the neighbour `ghost` if the membrane around `owner` continued unstretched [m].
  [[nodiscard]] Vec3f Ghost(Index owner, Index ghost) const {
    const Frame frame = FrameAt(owner);
    if (!frame.valid) return holder_.Place(owner) + holder_.Rest(ghost) - holder_.Rest(owner);
    const Vec2f dm = holder_.Material(ghost) - holder_.Material(owner);
    // Unstretched: the free edge of a slit carries no tension.
    const float ds = std::max(1.0f, frame.ds.norm()), dt = std::max(1.0f, frame.dt.norm());
    return holder_.Place(owner) + frame.ds * (dm.x() / ds) + frame.dt * (dm.y() / dt);
  }

 private:
  struct Frame {
    Vec3f ds, dt;  // d(position)/ds and /dt at a node.
    bool valid;
  };

  // Least squares over the live edges at the node: dx = ds * Ds + dt * Dt.
  [[nodiscard]] Frame FrameAt(Index node) const {
    Eigen::Matrix2f normal_matrix = Eigen::Matrix2f::Zero();
    Eigen::Matrix<float, 3, 2> moment = Eigen::Matrix<float, 3, 2>::Zero();
    ForEachNeighbour(node, [&](Index other, std::size_t edge) {
      if (holder_.Severed(edge) || holder_.Gone(other)) return;
      const Vec2f dm = holder_.Material(other) - holder_.Material(node);
      normal_matrix += dm * dm.transpose();
      moment += (holder_.Place(other) - holder_.Place(node)) * dm.transpose();
    });
    // Two nearly collinear edges do not determine the other direction: limit at 1 % of a right angle's determinant.
    const float trace = normal_matrix.trace();
    if (normal_matrix.determinant() <= 0.01f * trace * trace / 4) return {Vec3f::Zero(), Vec3f::Zero(), false};
    const Eigen::Matrix<float, 3, 2> frame = moment * normal_matrix.inverse();
    return {frame.col(0), frame.col(1), true};
  }

  const Holder& holder_;
};

}  // namespace fulcrum
