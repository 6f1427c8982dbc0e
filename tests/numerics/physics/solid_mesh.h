// Solids on regular meshes of tetrahedra for the reference solver, with loads and supports.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "tests/numerics/physics/reference/elastic_energy.h"

namespace fulcrum::physics {

inline constexpr double kSolidYoungs_Pa = 1e5;

/// A block of bricks with nodes (i, j, k), each cut into six tetrahedra along the diagonal 000-111 (Kuhn), as the
/// procedural organ is.
struct SolidMesh {
  ElasticModel model;
  std::array<int, 3> bricks{};
  bool closed = false;  ///< The second direction is periodic: its last node is its first.

  [[nodiscard]] Index Node(int i, int j, int k) const {
    const int across = bricks[1] + (closed ? 0 : 1);
    return static_cast<Index>((i * across + (closed ? j % bricks[1] : j)) * (bricks[2] + 1) + k);
  }
  [[nodiscard]] reference::Points Rest() const { return reference::RestPoints(model); }
  [[nodiscard]] reference::Points NoLoad() const {
    return reference::Points::Zero(3, static_cast<Eigen::Index>(model.mass.size()));
  }
};

/// A mesh with kSolidYoungs_Pa and a mass of 1 at each node. @param place of node (i, j, k) [m].
[[nodiscard]] SolidMesh MakeSolid(std::array<int, 3> bricks, bool closed, double poisson,
                                  const std::function<Vec3d(int, int, int)>& place);

/// A bar along x from the origin, of square cross-section; y and z start at 0 (a plane of symmetry where needed).
[[nodiscard]] SolidMesh MakeBar(int n, double length, double thickness, double poisson);

/// Adds the nodal forces of a traction [Pa] on those faces of tets whose corners are all in the set: exact for
/// tractions up to the third degree over each face.
void AddTraction(const SolidMesh& mesh, const std::function<bool(const Vec3d&)>& on_face,
                 const std::function<Vec3d(const Vec3d& place, const Vec3d& outward)>& traction,
                 reference::Points* load);

/// Coordinates that are held: those for which `where(place, axis)` is true.
[[nodiscard]] std::vector<bool> HeldWhere(const SolidMesh& mesh, const std::function<bool(const Vec3d&, int)>& where);

/// Displacement from rest under dead loads, applied in `steps` equal parts.
[[nodiscard]] reference::Points Displacement(const SolidMesh& mesh, const std::vector<bool>& held,
                                             const reference::Points& load, double tolerance_N, int steps = 1);

}  // namespace fulcrum::physics
