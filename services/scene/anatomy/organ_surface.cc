#include "services/scene/anatomy/organ_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "services/scene/builder/geometry.h"
#include "services/scene/compiler/tetrahedralise.h"

namespace fulcrum::scene {

std::string Ply(const TriangleMesh& mesh) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\ncomment millimetres; x left, y cranial, z anterior\n"
      "element vertex " +
      std::to_string(mesh.vertices.size()) + "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
      std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  for (const Vec3d& p : mesh.vertices) {
    for (int k = 0; k < 3; ++k) put(static_cast<float>(p[k]));
  }
  for (const Triangle& t : mesh.triangles) {
    put(std::uint8_t{3});
    for (const Index v : t) put(static_cast<std::int32_t>(v));
  }
  return bytes;
}

int PiecesOf(const TriangleMesh& mesh) {
  std::vector<Index> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 1; k < 3; ++k) parent[root(t[k])] = root(t[0]);
  }
  std::set<Index> roots;
  for (const Triangle& t : mesh.triangles) roots.insert(root(t[0]));
  return static_cast<int>(roots.size());
}

Vec3d MiddleOf(const TriangleMesh& mesh) {
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& p : mesh.vertices) sum += p;
  return sum / static_cast<double>(std::max<std::size_t>(mesh.vertices.size(), 1));
}

double VolumeOf(const TriangleMesh& mesh) {
  TriangleMesh centred = mesh;
  const Vec3d middle = MiddleOf(mesh);
  for (Vec3d& p : centred.vertices) p -= middle;
  return EnclosedVolume(centred);
}

bool IsOpen(const TriangleMesh& mesh) {
  std::set<std::array<Index, 2>> edges;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) edges.insert({t[k], t[(k + 1) % 3]});
  }
  return std::ranges::any_of(edges, [&](const auto& edge) { return !edges.contains({edge[1], edge[0]}); });
}

bool TurnOutward(TriangleMesh* mesh) {
  constexpr double kSheet = 0.0025;  // Of the area to the power of 1.5. A ball has 0.094.
  double area = 0;
  for (const Triangle& t : mesh->triangles) {
    const Vec3d& a = mesh->vertices[t[0]];
    area += (mesh->vertices[t[1]] - a).cross(mesh->vertices[t[2]] - a).norm() / 2;
  }
  if (VolumeOf(*mesh) > -kSheet * std::pow(area, 1.5)) return false;
  for (Triangle& t : mesh->triangles) std::swap(t[1], t[2]);
  return true;
}

bool AreNear(const TriangleMesh& one, const TriangleMesh& other, double reach) {
  const TriangleLocator locator(other.vertices, other.triangles);
  return std::ranges::any_of(one.vertices,
                             [&](const Vec3d& p) { return locator.Closest(p, reach).triangle != kNoIndex; });
}

}  // namespace fulcrum::scene
