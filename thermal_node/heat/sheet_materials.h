// The materials of the sheets of a scene, and where they lie.
#pragma once

#include <cstdint>
#include <vector>

#include "services/base/core/scene_view.h"
#include "thermal_node/heat/material.h"
#include "thermal_node/heat/sheet.h"

namespace fulcrum::thermal {

/// By sheet of SheetsOf: the number of its material. Sheets over bodies that have the same thickness and conductivities
/// share one; a sheet that is spanned freely has one to itself, because its current leaves through its own ends.
[[nodiscard]] std::vector<std::uint8_t> MaterialOfSheets(const SheetScene& scene);

/// The materials by number, at least one; `make` of `params` with the values of each.
/// Throws InputError naming the sheet, the parameter, its value and the valid range.
[[nodiscard]] std::vector<Material> MakeMaterials(const SheetScene& scene, const ThermalParams& params,
                                                  Material (*make)(const ThermalParams&));

/// Sets `materials`, `material_of_tile` and `bands` of a sheet with cells. Throws InputError when a tile holds tissue
/// of two materials.
void AddMaterials(const SheetScene& scene, Sheet* sheet);

}  // namespace fulcrum::thermal
