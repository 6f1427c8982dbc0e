// A flat rectangular membrane without organ, and a tip dragged over it, for thermal tests and benchmarks.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "services/scene/format/scene_file.h"
#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::thermal {

/// Sheet of cols x rows nodes in the plane z = 0 with its corner at (0, 0), default thermal parameters.
inline scene::SceneData FlatScene(std::uint32_t rows, std::uint32_t cols, float spacing_m) {
  scene::SceneData data;
  data.fixed.hash = 42;
  data.fixed.membrane = {0, rows, cols, 1e-4f};
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < cols; ++c) {
      const Vec2f p(static_cast<float>(c) * spacing_m, static_cast<float>(r) * spacing_m);
      data.membrane_material.push_back(p);
      data.rest_position.push_back(Vec3f(p.x(), p.y(), 0));
      data.inverse_mass.push_back(1);
      data.membrane_rest_length.push_back(c + 1 < cols ? spacing_m : 0);
      data.membrane_rest_length.push_back(r + 1 < rows ? spacing_m : 0);
      data.membrane_rest_length.push_back(r + 1 < rows && c + 1 < cols ? spacing_m * std::sqrt(2.0f) : 0);
    }
  }
  return data;
}

/// Moves from `from` to `to` at constant speed with the current on, one frame per call.
struct Drag {
  Vec2f from = Vec2f::Zero(), to = Vec2f::Zero();  ///< [m]
  float speed_m_s = 0.005f;
  CauteryMode mode = CauteryMode::kCut;
  float power_W = 35;
  float radius_m = 5e-4f;
  Vec2f half = Vec2f::Zero();
  bool tented = false;

  [[nodiscard]] int frames(float dt_s) const {
    return static_cast<int>(std::lround((to - from).norm() / (speed_m_s * dt_s)));
  }
  [[nodiscard]] TipInput At(int frame, float dt_s) const {
    const float count = static_cast<float>(frames(dt_s));
    const float a = static_cast<float>(frame) / count, b = static_cast<float>(frame + 1) / count;
    TipInput input;
    input.active = true;
    input.path.from = from + a * (to - from);
    input.path.to = from + b * (to - from);
    input.path.radius_m = radius_m;
    input.path.half = half;
    input.path.tented = tented;
    input.mode = mode;
    input.power_W = power_W;
    return input;
  }
};

/// Runs the whole drag.
inline void RunDrag(const Drag& drag, float dt_s, ThermalSolver* solver) {
  for (int frame = 0; frame < drag.frames(dt_s); ++frame) solver->Step(drag.At(frame, dt_s), dt_s);
}

/// Extents of the effects of a straight drag, measured across its path over the middle 80 % of its length.
struct SlitFigures {
  float width_min_m = 0, width_mean_m = 0, width_max_m = 0;  ///< Removed cells across.
  float brown_m = 0;                                         ///< Collagen damage >= 1, to one side of the slit, mean.
  float dead_m = 0;                                          ///< Cell death >= 1, likewise.
  float warm_m = 0;             ///< At or above 45 C at the end of the drag near its end, to one side.
  int surviving_crossings = 0;  ///< Live mesh edges that cross the path.
};

SlitFigures MeasureSlit(const ThermalSolver& solver, const SceneView& scene, const Drag& drag);

}  // namespace fulcrum::thermal
