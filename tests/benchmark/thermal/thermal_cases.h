// The cases of the thermal benchmark, by subject; each runs only if its keys are requested.
#pragma once

#include <string>

#include "services/base/core/scene_view.h"
#include "tests/benchmark/report.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::thermal {

/// A frame of the node [s].
inline constexpr float kFrame_s = 0.01f;

/// Conduction: moving Gaussians and orders of convergence.
void HeatCases(benchmark::Report* report);
/// Potential against the logarithm.
void PotentialCases(benchmark::Report* report);
/// The whole node on ports in the built-in scene, its checkpoint and patch; and an idle frame.
void NodeCases(benchmark::Report* report);
/// Shape of cuts by speed and mode, and the error of the coupling step.
void CutCases(benchmark::Report* report);
/// Sheets with a thickness and a support of their own.
void SheetsCases(benchmark::Report* report);
/// Published measurements and bounds by energy.
void PublishedCases(benchmark::Report* report);

/// 30 mm along the built-in membrane, where the scene's script cuts.
[[nodiscard]] Drag BuiltInDrag(const SceneView& scene, float speed_m_s);

/// Writes thermal_NAME.png, 12 mm wide around the centre, to the folder of the figures.
void Picture(const ThermalSolver& solver, const SceneView& scene, const Vec2f& centre, const std::string& name);

}  // namespace fulcrum::thermal
