#include "tests/benchmark/truth/hertz.h"

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "physics_node/simulation/script_player.h"
#include "services/scene/format/colouring.h"
#include "services/scene/format/scene_file.h"

namespace fulcrum {
namespace {

constexpr double kBall_m = 0.010, kHalf_m = 0.020, kHeight_m = 0.020, kPoisson = 0.45, kYoungs_Pa = 1e4;
/// Size of a cell under the ball, with 12 bricks along half of the side [m].
constexpr double kCell_m = 0.6e-3;
constexpr int kBricks = 12;

/// From 0 to `all` over u in [0, 1], finest at 0.
double Graded(double u, double all) {
  const double slope = kCell_m * kBricks;
  return slope * u + (all - slope) * u * u * u;
}

scene::SceneData Block(int bricks) {
  scene::SceneData data;
  SceneView& fixed = data.fixed;
  std::strncpy(fixed.name, "block", sizeof(fixed.name) - 1);
  fixed.hash = 7;
  fixed.physics.mode = PhysicsMode::kAccurate;
  fixed.physics.preset = PhysicsPreset::kReference;
  fixed.physics.tube_youngs_modulus_Pa = static_cast<float>(kYoungs_Pa);
  fixed.physics.tube_poisson = static_cast<float>(kPoisson);
  fixed.physics.friction = 0;
  fixed.physics.collision_margin_m = 0;
  fixed.physics.damping_per_s = 20;
  fixed.tools[0] = {ToolKind::kGrasper, Vec3f(0, 0, 0.3f), 0.001f, 0.3f, static_cast<float>(kBall_m), 0.001f};
  const int side = 2 * bricks, down = bricks;
  const auto vertex = [&](int i, int j, int k) { return static_cast<Index>((i * (side + 1) + j) * (down + 1) + k); };
  const auto across = [&](int i) {
    const double u = static_cast<double>(i - bricks) / bricks;
    return std::copysign(Graded(std::abs(u), kHalf_m), u);
  };
  std::vector<double> mass;
  for (int i = 0; i <= side; ++i) {
    for (int j = 0; j <= side; ++j) {
      for (int k = 0; k <= down; ++k) {
        const Vec3d p(across(i), across(j), -Graded(static_cast<double>(k) / down, kHeight_m));
        data.rest_position.push_back(p.cast<float>());
        data.inverse_mass.push_back(k == down ? 0.0f : 1.0f);
      }
    }
  }
  mass.assign(data.rest_position.size(), 0);
  constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      for (int k = 0; k < down; ++k) {
        for (const auto& path : kPaths) {
          std::array<int, 3> at{i, j, k};
          Tetrahedron t{vertex(i, j, k), 0, 0, 0};
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[static_cast<std::size_t>(path[step])];
            t[step + 1] = vertex(at[0], at[1], at[2]);
          }
          const auto& x = data.rest_position;
          double volume = static_cast<double>((x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).dot(x[t[3]] - x[t[0]])) / 6;
          if (volume < 0) std::swap(t[2], t[3]);
          for (const Index v : t) mass[v] += 1050 * std::abs(volume) / 4;
          data.tets.push_back(t);
        }
      }
    }
  }
  for (std::size_t v = 0; v < mass.size(); ++v) {
    if (data.inverse_mass[v] > 0) data.inverse_mass[v] = static_cast<float>(1 / mass[v]);
  }
  // The upper face alone is touched.
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      data.tube_surface.push_back({vertex(i, j, 0), vertex(i + 1, j, 0), vertex(i + 1, j + 1, 0)});
      data.tube_surface.push_back({vertex(i, j, 0), vertex(i + 1, j + 1, 0), vertex(i, j + 1, 0)});
    }
  }
  data.tet_colours = scene::SortByColour(&data.tets, data.rest_position.size(), [](const Tetrahedron& t) { return t; });
  fixed.tube_vertex_count = static_cast<Index>(data.rest_position.size());
  // A sheet is part of every scene: far below, and fixed.
  constexpr std::uint32_t kSheet = 9;
  constexpr float kSpacing_m = 0.002f;
  fixed.membrane = {fixed.tube_vertex_count, kSheet, kSheet, 1e-4f};
  for (std::uint32_t r = 0; r < kSheet; ++r) {
    for (std::uint32_t c = 0; c < kSheet; ++c) {
      const Vec2f place(kSpacing_m * static_cast<float>(c), kSpacing_m * static_cast<float>(r));
      data.rest_position.emplace_back(place.x(), place.y(), -0.2f);
      data.inverse_mass.push_back(0);
      data.membrane_material.push_back(place);
      data.membrane_rest_length.push_back(c + 1 < kSheet ? kSpacing_m : 0);
      data.membrane_rest_length.push_back(r + 1 < kSheet ? kSpacing_m : 0);
      data.membrane_rest_length.push_back(c + 1 < kSheet && r + 1 < kSheet ? kSpacing_m * std::sqrt(2.0f) : 0);
    }
  }
  return data;
}

/// Their eq. 13 with the coefficients of a bonded layer.
double Expected(double depth_m) {
  constexpr double nu = kPoisson, pi = std::numbers::pi;
  const double chi = std::sqrt(kBall_m * depth_m) / kHeight_m;
  const double a = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1 - nu);
  const double b = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1 - nu);
  const double layer = 1 - 2 * a / pi * chi + 4 * a * a / (pi * pi) * chi * chi -
                       8 / std::pow(pi, 3) * (a * a * a + 4 * pi * pi / 15 * b) * std::pow(chi, 3) +
                       16 * a / std::pow(pi, 4) * (a * a * a + 3 * pi * pi / 5 * b) * std::pow(chi, 4);
  return 4.0 / 3 * kYoungs_Pa / (1 - nu * nu) * std::sqrt(kBall_m) * std::pow(depth_m, 1.5) * layer;
}

}  // namespace

std::vector<HertzPoint> PressBall(int bricks) {
  using namespace physics;
  const scene::SceneData data = Block(bricks);
  const SceneView scene = data.View();
  TissueSimulation simulation(scene, 2);
  constexpr float kNeither = 0.35f;  // Neither grasps nor lets go.
  constexpr int kMove = 50, kRest = 100;
  std::vector<HertzPoint> points;
  double from_mm = -0.5;
  std::array<ToolInput, kMaxTools> tools{};
  for (const double to_mm : {0.5, 0.75, 1.0}) {
    for (int i = 0; i < kMove + kRest; ++i) {
      const double mm = from_mm + (to_mm - from_mm) * std::min(1.0, (i + 1.0) / kMove);
      // The ball's centre is the tip.
      const Vec3f tip(0, 0, static_cast<float>(kBall_m - 1e-3 * mm));
      tools[0] = {true, PoseAtTip(scene.tools[0], tip, kNeither)};
      (void)simulation.Step(tools);
    }
    points.push_back({1e-3 * to_mm, static_cast<double>(simulation.solver_force(0).norm()), Expected(1e-3 * to_mm)});
    from_mm = to_mm;
  }
  return points;
}

}  // namespace fulcrum
