#include "tests/numerics/cut/strip_pull.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics_node/simulation/tissue_simulation.h"
#include "tests/numerics/thermal/topology_validator.h"
#include "tests/unit/physics/sheet_scene.h"
#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::cut {
namespace {

constexpr float kStill_m_s = 1e-3f;
constexpr double kPullOn_s = 1;  ///< Duration of the pull after the first tear, while the strip is connected.

/// True if a path of live edges leads from the left clamp to the right one.
bool HangsTogether(const physics::TissueModel& model) {
  const Index rows = model.rows(), cols = model.cols();
  std::vector<std::uint8_t> seen(std::size_t{rows} * cols, 0);
  std::vector<Index> stack;
  const auto enter = [&](bool alive, Index node) {
    if (!alive || seen[node] != 0) return;
    seen[node] = 1;
    stack.push_back(node);
  };
  for (Index r = 0; r < rows; ++r) enter(true, r * cols);
  while (!stack.empty()) {
    const Index at = stack.back(), r = at / cols, c = at % cols;
    stack.pop_back();
    if (c + 1 == cols) return true;
    enter(model.EdgeAlive(at, 0), at + 1);
    enter(r + 1 < rows && model.EdgeAlive(at, 1), at + cols);
    enter(r + 1 < rows && model.EdgeAlive(at, 2), at + cols + 1);
    enter(c > 0 && model.EdgeAlive(at - 1, 0), at - 1);
    enter(r > 0 && model.EdgeAlive(at - cols, 1), at - cols);
    enter(r > 0 && c > 0 && model.EdgeAlive(at - cols - 1, 2), at - cols - 1);
  }
  return false;
}

}  // namespace

scene::SceneData StripScene(const StripSettings& s) {
  const auto nodes = [&](float length) { return static_cast<std::uint32_t>(std::lround(length / s.h_m)) + 1; };
  scene::SceneData data = physics::SheetScene(nodes(s.width_m), nodes(s.length_m), s.h_m);
  const std::uint32_t rows = data.fixed.membrane.rows, cols = data.fixed.membrane.cols;
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < cols; ++c) {
      const bool held = c == 0 || c + 1 == cols || (s.guided && (r == 0 || r + 1 == rows));
      data.inverse_mass[r * cols + c] = held ? 0.0f : 1.0f / (0.5f * s.h_m * s.h_m);
    }
  }
  data.fixed.physics.mode = PhysicsMode::kAccurate;
  data.fixed.physics.tear_stretch = s.tear_stretch;
  data.fixed.physics.membrane_prestrain = s.prestrain;
  return data;
}

StripResult PullStrip(const StripSettings& s) {
  const scene::SceneData data = StripScene(s);
  const SceneView scene = data.View();
  physics::TissueSimulation physics(scene);
  thermal::ThermalSolver thermal(scene);
  thermal::TopologyValidator validator(scene, thermal.field().sheet());
  TopologyState topology;
  topology.scene_hash = scene.hash;
  topology.rows = scene.membrane.rows;
  topology.cols = scene.membrane.cols;
  StripResult result;
  const float dt = scene.physics.dt_s;
  std::vector<float> xyz(3 * scene.rest_position.size()), before = xyz;
  physics.particles().CopyPositions(before);
  double torn_s = -1, moved_s = 0;
  float way = 0;
  const float length = scene.rest_position[scene.membrane.first + scene.membrane.cols - 1].x();
  for (int i = 1; (torn_s < 0 ? i * dt < s.most_s : i * dt < torn_s + kPullOn_s + s.after_s); ++i) {
    const double time_s = static_cast<double>(i) * static_cast<double>(dt);
    if (torn_s < 0 || (result.apart_s < 0 && time_s < torn_s + kPullOn_s)) {
      way += s.speed_m_s * dt;
      for (Index node = 0; node < scene.membrane.node_count(); ++node) {
        const Index particle = scene.membrane.first + node;
        if (scene.inverse_mass[particle] > 0.0f) continue;
        const Vec3f& rest = scene.rest_position[particle];
        physics.particles().Set(physics.particles().Ref(particle), rest + way * rest.x() / length * Vec3f::UnitX());
      }
    }
    result.asleep = physics.Step({}).asleep;
    if (physics.tears().torn_count() != result.torn_edges) {
      result.torn_edges = physics.tears().torn_count();
      thermal.Tear(physics.tears().torn());
      if (torn_s < 0) {
        torn_s = time_s;
        result.torn = true;
        result.stretch = (1 + s.prestrain) * (1 + way / length);
      }
    }
    thermal.Step(std::span<const thermal::TipInput>(), dt);
    if (thermal.committed()) {
      topology.revision = thermal.topology().revision();
      topology.dead_nodes = thermal.topology().committed().dead_nodes;
      topology.dead_edges = thermal.topology().committed().dead_edges;
      topology.shrink = thermal.topology().committed().shrink;
      physics.ApplyTopology(topology);
      if (result.fault.empty()) result.fault = validator.Check(thermal);
      if (result.apart_s < 0 && !HangsTogether(physics.model())) result.apart_s = time_s - torn_s;
    }
    physics.particles().CopyPositions(xyz);
    float fastest = 0;
    for (std::size_t k = 0; k < xyz.size(); ++k) {
      result.finite = result.finite && std::isfinite(xyz[k]);
      fastest = std::max(fastest, std::abs(xyz[k] - before[k]) / dt);
    }
    std::swap(xyz, before);
    if (fastest > kStill_m_s) moved_s = time_s;
    result.still_s = torn_s >= 0 && time_s > moved_s + 0.2 ? moved_s - torn_s : -1;
  }
  result.severed_edges = thermal.topology().dead_edge_count();
  return result;
}

}  // namespace fulcrum::cut
