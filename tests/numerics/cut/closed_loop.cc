#include "tests/numerics/cut/closed_loop.h"

#include <algorithm>
#include <cmath>

#include "thermal_node/coupling/open_window.h"

namespace fulcrum::cut {

ClosedLoop::ClosedLoop(const SceneView& scene)
    : scene_(scene),
      physics_(scene_),
      thermal_(scene_),
      tracker_(thermal_.field().sheet(), scene_.thermal.hook_radius_m) {
  topology_.scene_hash = open_cells_.scene_hash = scene_.hash;
  topology_.rows = scene_.membrane.rows;
  topology_.cols = scene_.membrane.cols;
}

const LoopStep& ClosedLoop::Step(const Moment& moment) {
  const float dt_s = scene_.physics.dt_s;
  physics_.Step(moment.tools);
  step_.time_s = static_cast<double>(dt_s) * static_cast<double>(++steps_);
  step_.contact = physics_.Cautery(1);
  step_.contact.session_time_s = step_.time_s;
  step_.mode = moment.mode;
  if (const auto& tears = physics_.tears(); tears.torn_count() > 0) thermal_.Tear(tears.torn());
  if (tracker_.Accepts(step_.contact))
    thermal_.Step(tracker_.Advance(step_.contact, {moment.mode, moment.power_W}, dt_s), dt_s);
  if (thermal_.committed()) {
    const thermal::MeshTopology& mesh = thermal_.topology();
    topology_.revision = mesh.revision();
    topology_.dead_nodes = mesh.committed().dead_nodes;
    topology_.dead_edges = mesh.committed().dead_edges;
    topology_.shrink = mesh.committed().shrink;
    physics_.ApplyTopology(topology_);
  }
  if (step_.contact.touching) {
    thermal::FillOpenCells(thermal_.field(), step_.contact.material, &open_cells_);
    physics_.SetOpenCells(open_cells_);
  }
  step_.length_m = thermal_.cut_length_m();
  step_.power_W = thermal_.figures().power_W;
  return step_;
}

std::vector<LoopStep> ClosedLoop::Run(const Operator& hand, double duration_s) {
  std::vector<LoopStep> steps;
  while (step_.time_s < duration_s - 1e-6) {
    steps.push_back(Step(hand(step_.time_s + static_cast<double>(scene_.physics.dt_s))));
  }
  return steps;
}

physics::ToolPose PoseAtTip(const ToolDescription& tool, const Vec3f& p_WT) {
  const Vec3f z = (p_WT - tool.p_WP).normalized();
  const Vec3f x = (Vec3f::UnitX() - z.x() * z).normalized();
  Mat3f R;
  R << x, z.cross(x), z;
  return {p_WT, Quatf(R), 0};
}

Vec3f PlaceOnSheet(const SceneView& scene, const Vec2f& fractions, float height_m) {
  const MembraneGrid& grid = scene.membrane;
  const auto at = [](float fraction, std::uint32_t count, Index* cell) {
    const float x = std::clamp(fraction, 0.0f, 1.0f) * static_cast<float>(count - 1);
    *cell = std::min(static_cast<Index>(x), count - 2);
    return x - static_cast<float>(*cell);
  };
  Index row = 0, col = 0;
  const float v = at(fractions.y(), grid.rows, &row), u = at(fractions.x(), grid.cols, &col);
  const auto node = [&](Index r, Index c) { return scene.rest_position[grid.first + r * grid.cols + c]; };
  const Vec3f a = node(row, col), b = node(row, col + 1), c = node(row + 1, col), d = node(row + 1, col + 1);
  const Vec3f place = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
  return place + height_m * (b - a).cross(c - a).normalized();
}

}  // namespace fulcrum::cut
