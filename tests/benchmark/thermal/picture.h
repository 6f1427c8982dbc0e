// Pictures of the sheet for visual inspection.
#pragma once

#include <filesystem>

#include "thermal_node/coupling/thermal_solver.h"

namespace fulcrum::thermal {

/// Writes temperature, damage and mesh around `centre` as three pictures side by side, `width_m` wide each, with their
/// scales. Holes are black in all.
void WritePicture(const ThermalSolver& solver, const SceneView& scene, const Vec2f& centre, float width_m,
                  const std::filesystem::path& file);

}  // namespace fulcrum::thermal
