#include "tests/numerics/physics/solid_mesh.h"

#include <cmath>

#include "tests/numerics/physics/reference/static_solver.h"

namespace fulcrum::physics {

using reference::ElasticEnergy;
using reference::Points;

SolidMesh MakeSolid(std::array<int, 3> bricks, bool closed, double poisson,
                    const std::function<Vec3d(int, int, int)>& place) {
  SolidMesh mesh;
  mesh.bricks = bricks;
  mesh.closed = closed;
  ElasticModel& model = mesh.model;
  for (int i = 0; i <= bricks[0]; ++i) {
    for (int j = 0; j < bricks[1] + (closed ? 0 : 1); ++j) {
      for (int k = 0; k <= bricks[2]; ++k) {
        model.rest_position.push_back(place(i, j, k));
      }
    }
  }
  model.mass.assign(model.rest_position.size(), 1.0);
  model.mu_Pa = kSolidYoungs_Pa / (2 * (1 + poisson));
  model.lambda_Pa = kSolidYoungs_Pa * poisson / ((1 + poisson) * (1 - 2 * poisson));
  constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int i = 0; i < bricks[0]; ++i) {
    for (int j = 0; j < bricks[1]; ++j) {
      for (int k = 0; k < bricks[2]; ++k) {
        for (const auto& path : kPaths) {
          std::array<int, 3> at{i, j, k};
          ElasticTet tet;
          tet.v[0] = mesh.Node(i, j, k);
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[static_cast<std::size_t>(path[step])];
            tet.v[step + 1] = mesh.Node(at[0], at[1], at[2]);
          }
          Mat3d edges;
          const auto fill = [&] {
            for (int c = 0; c < 3; ++c) {
              edges.col(c) =
                  model.rest_position[tet.v[static_cast<std::size_t>(c) + 1]] - model.rest_position[tet.v[0]];
            }
          };
          fill();
          if (edges.determinant() < 0) {
            std::swap(tet.v[2], tet.v[3]);
            fill();
          }
          tet.volume = edges.determinant() / 6;
          tet.inverse_edges = edges.inverse();
          model.tets.push_back(tet);
        }
      }
    }
  }
  AddOrganPatches(&model);
  return mesh;
}

SolidMesh MakeBar(int n, double length, double thickness, double poisson) {
  const double h = thickness / n;
  return MakeSolid({static_cast<int>(std::lround(length / h)), n, n}, false, poisson,
                   [h](int i, int j, int k) { return Vec3d(i * h, j * h, k * h); });
}

void AddTraction(const SolidMesh& mesh, const std::function<bool(const Vec3d&)>& on_face,
                 const std::function<Vec3d(const Vec3d& place, const Vec3d& outward)>& traction, Points* load) {
  constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  // Dunavant 1985, degree 4: two orbits of three points, each at (1 - 2 b, b, b).
  constexpr double kOrbits[2][2] = {{0.445948490915965, 0.223381589678011}, {0.091576213509771, 0.109951743655322}};
  for (const ElasticTet& tet : mesh.model.tets) {
    for (const auto& face : kFaces) {
      std::array<Index, 3> v;
      std::array<Vec3d, 3> x;
      bool inside = true;
      for (std::size_t c = 0; c < 3; ++c) {
        v[c] = tet.v[static_cast<std::size_t>(face[c])];
        x[c] = mesh.model.rest_position[v[c]];
        inside = inside && on_face(x[c]);
      }
      if (!inside) continue;
      const Vec3d area = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]);
      const Vec3d outward = area.normalized();
      for (const auto& [b, weight] : kOrbits) {
        for (std::size_t at = 0; at < 3; ++at) {
          const Vec3d place = b * (x[0] + x[1] + x[2]) + (1 - 3 * b) * x[at];
          const Vec3d force = area.norm() * weight * traction(place, outward);
          for (std::size_t c = 0; c < 3; ++c) load->col(v[c]) += (c == at ? 1 - 2 * b : b) * force;
        }
      }
    }
  }
}

std::vector<bool> HeldWhere(const SolidMesh& mesh, const std::function<bool(const Vec3d&, int)>& where) {
  std::vector<bool> held;
  for (const Vec3d& place : mesh.model.rest_position) {
    for (int axis = 0; axis < 3; ++axis) held.push_back(where(place, axis));
  }
  return held;
}

Points Displacement(const SolidMesh& mesh, const std::vector<bool>& held, const Points& load, double tolerance_N,
                    int steps) {
  const Points rest = mesh.Rest();
  const ElasticEnergy energy(mesh.model);
  Points x = rest;
  for (int step = 1; step <= steps; ++step) {
    x = SolveStatic(energy, x, held, static_cast<double>(step) / steps * load, tolerance_N).x;
  }
  return x - rest;
}

}  // namespace fulcrum::physics
