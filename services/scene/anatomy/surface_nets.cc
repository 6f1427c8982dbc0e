#include "services/scene/anatomy/surface_nets.h"

#include <algorithm>
#include <array>
#include <utility>

namespace fulcrum::scene {
namespace {

constexpr int kSmoothing = 60;
/// Shares of the way to the mean of the neighbours, in turns: the second step undoes the shrinking of the first, not
/// the smoothing (Taubin 1995).
constexpr double kRelax[2] = {0.6, -0.613};
constexpr double kLargest = 0.49;  ///< Of a voxel, away from the middle of the vertex' cube.

/// A vertex in the middle of eight voxels of which not all have one label, with neighbours across its cube's faces.
struct Net {
  std::vector<Vec3d> start, now;                 ///< In voxels.
  std::vector<std::array<Index, 6>> neighbours;  ///< kNoIndex: none.
};

class NetBuilder {
 public:
  explicit NetBuilder(const LabelMap& map) : map_(map) {
    // A layer of nothing around the map closes what it cuts off.
    for (std::size_t a = 0; a < 3; ++a) cubes_[a] = map.size[a] + 1;
  }

  std::map<int, TriangleMesh> Build(const std::vector<int>& wanted) {
    wanted_.assign(65536, false);
    for (const int label : wanted) wanted_[static_cast<std::size_t>(label)] = true;
    PlaceVertices();
    Connect();
    Smooth();
    for (Vec3d& p : net_.now) p = map_.W_from_index * p;
    return Faces();
  }

 private:
  /// The label of a voxel, if it is wanted; 0 outside the map.
  [[nodiscard]] int Label(int i, int j, int k) const {
    if (i < 0 || j < 0 || k < 0 || i >= map_.size[0] || j >= map_.size[1] || k >= map_.size[2]) return 0;
    const int label = map_.labels[map_.Index(i, j, k)];
    return wanted_[static_cast<std::size_t>(label)] ? label : 0;
  }
  /// Cube (i, j, k) lies between voxels i - 1 and i, and so on.
  [[nodiscard]] std::size_t Cube(int i, int j, int k) const {
    return static_cast<std::size_t>(i) + static_cast<std::size_t>(cubes_[0]) *
                                             (static_cast<std::size_t>(j) + static_cast<std::size_t>(cubes_[1]) * k);
  }

  void PlaceVertices() {
    vertex_.assign(Cube(0, 0, cubes_[2]), kNoIndex);
    for (int k = 0; k < cubes_[2]; ++k) {
      for (int j = 0; j < cubes_[1]; ++j) {
        for (int i = 0; i < cubes_[0]; ++i) {
          const int first = Label(i - 1, j - 1, k - 1);
          bool differs = false;
          for (int corner = 1; corner < 8 && !differs; ++corner) {
            differs = Label(i - 1 + (corner & 1), j - 1 + (corner >> 1 & 1), k - 1 + (corner >> 2)) != first;
          }
          if (!differs) continue;
          vertex_[Cube(i, j, k)] = static_cast<Index>(net_.start.size());
          net_.start.emplace_back(i - 0.5, j - 0.5, k - 0.5);
          places_.push_back({i, j, k});
        }
      }
    }
    net_.now = net_.start;
  }

  /// Two cubes are neighbours if the four voxels around the face between them have more than one label.
  void Connect() {
    std::array<Index, 6> none;
    none.fill(kNoIndex);
    net_.neighbours.assign(net_.start.size(), none);
    for (std::size_t v = 0; v < places_.size(); ++v) {
      const auto& at = places_[v];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::array<int, 3> next = at;
        if (++next[axis] >= cubes_[axis]) continue;
        const Index other = vertex_[Cube(next[0], next[1], next[2])];
        if (other == kNoIndex) continue;
        const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
        // The face lies in the layer of voxels `at[axis]`.
        const auto label = [&](int db, int dc) {
          std::array<int, 3> voxel = at;
          voxel[b] += db - 1;
          voxel[c] += dc - 1;
          return Label(voxel[0], voxel[1], voxel[2]);
        };
        const int first = label(0, 0);
        if (label(1, 0) == first && label(0, 1) == first && label(1, 1) == first) continue;
        net_.neighbours[v][2 * axis + 1] = other;
        net_.neighbours[other][2 * axis] = static_cast<Index>(v);
      }
    }
  }

  void Smooth() {
    std::vector<Vec3d> old;
    for (int round = 0; round < 2 * kSmoothing; ++round) {
      old = net_.now;
      for (std::size_t v = 0; v < old.size(); ++v) {
        Vec3d sum = Vec3d::Zero();
        int count = 0;
        for (const Index other : net_.neighbours[v]) {
          if (other == kNoIndex) continue;
          sum += old[other];
          ++count;
        }
        if (count == 0) continue;
        const Vec3d moved = old[v] + kRelax[round % 2] * (sum / count - old[v]) - net_.start[v];
        net_.now[v] = net_.start[v] + moved.cwiseMax(-kLargest).cwiseMin(kLargest);
      }
    }
  }

  /// Between two voxels of different labels lie the four cubes around the edge that connects their centres.
  std::map<int, TriangleMesh> Faces() {
    // A map of indices that mirrors the patient turns faces over.
    const bool mirrored = map_.W_from_index.linear().determinant() < 0;
    std::map<int, TriangleMesh> meshes;
    std::map<int, std::vector<Index>> own;  // Of each label: its number of a vertex of the net.
    const auto add = [&](int label, std::array<Index, 4> quad, bool turned) {
      if (label == 0) return;
      TriangleMesh& mesh = meshes[label];
      std::vector<Index>& numbers = own[label];
      if (numbers.empty()) numbers.assign(net_.now.size(), kNoIndex);
      for (Index& v : quad) {
        Index& number = numbers[v];
        if (number == kNoIndex) {
          number = static_cast<Index>(mesh.vertices.size());
          mesh.vertices.push_back(net_.now[v]);
        }
        v = number;
      }
      if (turned != mirrored) std::swap(quad[1], quad[3]);
      // Along the shorter diagonal.
      const auto& x = mesh.vertices;
      if ((x[quad[0]] - x[quad[2]]).squaredNorm() <= (x[quad[1]] - x[quad[3]]).squaredNorm()) {
        mesh.triangles.push_back({quad[0], quad[1], quad[2]});
        mesh.triangles.push_back({quad[0], quad[2], quad[3]});
      } else {
        mesh.triangles.push_back({quad[1], quad[2], quad[3]});
        mesh.triangles.push_back({quad[1], quad[3], quad[0]});
      }
    };
    for (int k = -1; k < map_.size[2]; ++k) {
      for (int j = -1; j < map_.size[1]; ++j) {
        for (int i = -1; i < map_.size[0]; ++i) {
          const int here = Label(i, j, k);
          for (std::size_t axis = 0; axis < 3; ++axis) {
            std::array<int, 3> next{i, j, k};
            ++next[axis];
            const int there = Label(next[0], next[1], next[2]);
            if (here == there) continue;
            const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
            // Seen from `there`, counter-clockwise around the axis.
            std::array<Index, 4> quad;
            constexpr int kTurn[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
            for (std::size_t q = 0; q < 4; ++q) {
              std::array<int, 3> cube = next;
              cube[b] += kTurn[q][0];
              cube[c] += kTurn[q][1];
              quad[q] = vertex_[Cube(cube[0], cube[1], cube[2])];
            }
            add(here, quad, false);
            add(there, quad, true);
          }
        }
      }
    }
    return meshes;
  }

  const LabelMap& map_;
  std::array<int, 3> cubes_{};
  std::vector<bool> wanted_;
  std::vector<Index> vertex_;  ///< Of each cube.
  std::vector<std::array<int, 3>> places_;
  Net net_;
};

}  // namespace

std::map<int, TriangleMesh> SurfacesOf(const LabelMap& map, const std::vector<int>& wanted) {
  return NetBuilder(map).Build(wanted);
}

}  // namespace fulcrum::scene
