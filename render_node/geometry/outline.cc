#include "render_node/geometry/outline.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "services/base/core/scope.h"

namespace fulcrum::render {
namespace {

constexpr float kNearest_m = 0.004f;  // The near plane of MakeLaparoscope().

using Bits = std::array<std::uint32_t, 3>;

Bits BitsOf(const Vec3f& p) {
  Bits bits;
  std::memcpy(bits.data(), p.data(), sizeof bits);
  return bits;
}

}  // namespace

MeshEdges::MeshEdges(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
  std::map<Bits, Index> places;
  std::vector<Index> place_of;
  for (const Vec3f& p : positions) {
    const auto [at, is_new] = places.emplace(BitsOf(p), static_cast<Index>(positions_.size()));
    if (is_new) positions_.push_back(p);
    place_of.push_back(at->second);
  }
  std::map<std::pair<Index, Index>, std::vector<Index>> faces;  // Third corners, by edge.
  for (const Triangle& t : triangles) {
    const Triangle at{place_of[t[0]], place_of[t[1]], place_of[t[2]]};
    if (at[0] == at[1] || at[1] == at[2] || at[2] == at[0]) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      faces[std::minmax(at[k], at[(k + 1) % 3])].push_back(at[(k + 2) % 3]);
    }
  }
  const float least_cosine = std::cos(RadiansOf(kCrease_deg));
  for (const auto& [ends, opposite] : faces) {
    if (opposite.size() > 2) continue;
    Edge edge{ends.first, ends.second, {opposite.front(), opposite.back()}, false};
    const Vec3f& a = positions_[edge.a];
    const Vec3f along = (positions_[edge.b] - a).normalized();
    // Directions of the faces from the edge: opposite to each other where the surface is flat.
    std::array<Vec3f, 2> across;
    for (std::size_t k = 0; k < 2; ++k) {
      const Vec3f d = positions_[edge.opposite.at(k)] - a;
      across.at(k) = (d - d.dot(along) * along).normalized();
    }
    edge.sharp = -across[0].dot(across[1]) < least_cosine;
    edges_.push_back(edge);
  }
}

void AppendOutline(const MeshEdges& mesh, const Eigen::Matrix4f& to_camera, const Eigen::Matrix4f& projection,
                   const Vec2f& size, std::vector<EdgeLine>* lines) {
  const Mat3f turn = to_camera.topLeftCorner<3, 3>();
  const Vec3f shift = to_camera.topRightCorner<3, 1>();
  std::vector<Vec3f> in_camera;
  in_camera.reserve(mesh.positions().size());
  for (const Vec3f& p : mesh.positions()) in_camera.push_back(turn * p + shift);
  const auto pixel = [&](const Vec3f& p) {
    const Eigen::Vector4f clip = projection * p.homogeneous();
    return Vec2f((0.5f + 0.5f * clip.x() / clip.w()) * size.x(), (0.5f + 0.5f * clip.y() / clip.w()) * size.y());
  };
  for (const MeshEdges::Edge& edge : mesh.edges()) {
    Vec3f a = in_camera[edge.a], b = in_camera[edge.b];
    // The plane through eye and edge: a face that ends here lies on one side of it.
    const Vec3f plane = a.cross(b);
    const float side0 = plane.dot(in_camera[edge.opposite[0]]), side1 = plane.dot(in_camera[edge.opposite[1]]);
    const bool crease = side0 * side1 < 0;
    if (crease && !edge.sharp) continue;
    if (a.z() > -kNearest_m && b.z() > -kNearest_m) continue;
    if (a.z() > -kNearest_m || b.z() > -kNearest_m) {
      const Vec3f cut = a + (-kNearest_m - a.z()) / (b.z() - a.z()) * (b - a);
      (a.z() > b.z() ? a : b) = cut;
    }
    EdgeLine line;
    line.ends = {pixel(a), pixel(b)};
    const Vec2f low = line.ends[0].cwiseMin(line.ends[1]), high = line.ends[0].cwiseMax(line.ends[1]);
    if ((high.array() < 0).any() || (low.array() > size.array()).any()) continue;
    const Vec2f along = line.ends[1] - line.ends[0];
    if (along.squaredNorm() < 1e-6f) continue;  // Shorter than a thousandth of a pixel.
    line.outward = Vec2f(along.y(), -along.x()).normalized();
    // A point of a face, so near to the edge that it lies ahead of the lens as well.
    const Vec3f middle = 0.5f * (a + b);
    const Vec3f inside = middle + 1e-2f * (in_camera[edge.opposite[0]] - middle);
    if (line.outward.dot(pixel(inside) - line.ends[0]) > 0) line.outward = -line.outward;
    line.depths = {-a.z(), -b.z()};
    line.crease = crease;
    lines->push_back(line);
  }
}

float Coverage(const Vec2f& normal, float distance) {
  const float x = std::abs(normal.x()), y = std::abs(normal.y());
  const float longer = std::max(x, y), shorter = std::min(x, y);
  // Linear in the distance while the edge crosses two opposite sides of the pixel; a triangle at a corner.
  const float from_middle = std::abs(distance), corner = 0.5f * (longer + shorter) - from_middle;
  float beyond = 0;  // The share on the side of the edge on which the middle does not lie.
  if (from_middle <= 0.5f * (longer - shorter)) {
    beyond = 0.5f - from_middle / longer;
  } else if (corner > 0) {
    beyond = 0.5f * corner * corner / (longer * shorter);
  }
  return distance > 0 ? beyond : 1 - beyond;
}

}  // namespace fulcrum::render
