#include "tests/benchmark/physics/scaled_scene.h"

#include <cmath>
#include <numbers>

#include "services/scene/format/colouring.h"

namespace fulcrum::physics {

scene::SceneData MakeScaledScene(double factor) {
  const double root = std::sqrt(factor);
  const auto scaled = [root](double count) { return static_cast<Index>(std::lround(count * root)); };
  const Index rings = scaled(43), segments = scaled(24), rows = scaled(289), cols = scaled(64);
  constexpr double kRing_m = 0.0048, kRow_m = 0.0007, kCol_m = 0.0011, kGap_m = 0.0055, kWall_m = 0.003;
  const double radius = 0.018 * root;
  scene::SceneData data;
  SceneView& fixed = data.fixed;
  fixed.physics.preset = PhysicsPreset::kDefault;
  fixed.physics.damping_per_s = 20;
  fixed.physics.membrane_Et_N_per_m = 300;
  fixed.physics.membrane_prestrain = 0.04f;
  std::vector<double> mass;
  for (Index ring = 0; ring < rings; ++ring) {
    for (int layer = 0; layer < 2; ++layer) {
      for (Index s = 0; s < segments; ++s) {
        const double angle = 2 * std::numbers::pi * s / segments, r = radius - (layer == 0 ? kWall_m : 0);
        data.rest_position.push_back(Vec3d(r * std::sin(angle), kRing_m * ring, r * std::cos(angle)).cast<float>());
        mass.push_back(ring == 0 || ring + 1 == rings ? 0 : 1050 * kRing_m * kRing_m * kWall_m / 2);
      }
    }
  }
  const auto corner = [segments](Index ring, Index segment, Index layer) {
    return (ring * 2 + layer) * segments + segment % segments;
  };
  constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (Index ring = 0; ring + 1 < rings; ++ring) {
    for (Index segment = 0; segment < segments; ++segment) {
      for (const auto& path : kPaths) {
        Index step[3] = {0, 0, 0};
        Tetrahedron t{corner(ring, segment, 0), 0, 0, 0};
        for (std::size_t k = 0; k < 3; ++k) {
          step[path[k]] = 1;
          t[k + 1] = corner(ring + step[0], segment + step[1], step[2]);
        }
        const auto& x = data.rest_position;
        if ((x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).dot(x[t[3]] - x[t[0]]) < 0) {
          std::swap(t[2], t[3]);
        }
        data.tets.push_back(t);
      }
    }
  }
  data.tet_colours = scene::SortByColour(&data.tets, data.rest_position.size(), [](const Tetrahedron& t) { return t; });
  fixed.tube_vertex_count = static_cast<Index>(data.rest_position.size());
  fixed.membrane.first = fixed.tube_vertex_count;
  fixed.membrane.rows = rows;
  fixed.membrane.cols = cols;
  for (Index r = 0; r < rows; ++r) {
    for (Index c = 0; c < cols; ++c) {
      const double across = (c - 0.5 * (cols - 1)) * kCol_m;
      data.rest_position.push_back(Vec3d(across, kRow_m * r, radius + kGap_m).cast<float>());
      const bool rim = r == 0 || c == 0 || r + 1 == rows || c + 1 == cols;
      mass.push_back(rim ? 0 : 0.5 * kRow_m * kCol_m);
      data.membrane_rest_length.push_back(c + 1 < cols ? static_cast<float>(kCol_m) : 0.0f);
      data.membrane_rest_length.push_back(r + 1 < rows ? static_cast<float>(kRow_m) : 0.0f);
      data.membrane_rest_length.push_back(c + 1 < cols && r + 1 < rows ? static_cast<float>(std::hypot(kRow_m, kCol_m))
                                                                       : 0.0f);
      data.membrane_material.emplace_back(static_cast<float>(across), static_cast<float>(kRow_m * r));
    }
  }
  for (const double m : mass) {
    data.inverse_mass.push_back(m > 0 ? static_cast<float>(1 / m) : 0.0f);
  }
  return data;
}

}  // namespace fulcrum::physics
