// What the heat of a sheet depends on, of each sheet.
#pragma once

#include <vector>

#include "services/base/core/sheets.h"

namespace fulcrum {

/// Of its own [m], [W/mK], [S/m]; 0: the value of ThermalParams.
struct SheetHeat {
  float thickness_m = 0, conductivity_W_mK = 0, sigma_S_m = 0;
};

/// Valid values of their own; those of `thermal` have wider bounds in a file, which thermal_node narrows to these.
inline constexpr float kSheetThicknessMin_m = 1e-5f, kSheetThicknessMax_m = 5e-3f;
inline constexpr float kSheetConductivityMin_W_mK = 0.05f, kSheetConductivityMax_W_mK = 2.0f;
inline constexpr float kSheetSigmaMin_S_m = 1e-3f, kSheetSigmaMax_S_m = 5.0f;

/// Air on both sides.
[[nodiscard]] inline bool IsSpanned(const SheetPart& sheet) { return sheet.over == kNoIndex; }

/// The parameters of the scene with the sheet's own values.
[[nodiscard]] inline ThermalParams ThermalOf(const SheetPart& sheet, const ThermalParams& of_scene) {
  ThermalParams params = of_scene;
  if (sheet.thickness_m > 0.0f) params.thickness_m = sheet.thickness_m;
  if (sheet.conductivity_W_mK > 0.0f) params.conductivity_W_mK = sheet.conductivity_W_mK;
  if (sheet.sigma_S_m > 0.0f) params.sigma_S_m = sheet.sigma_S_m;
  return params;
}

/// By row of the grid: the thickness of its sheet [m].
[[nodiscard]] inline std::vector<float> ThicknessOfRows(const SheetScene& scene) {
  const std::vector<SheetPart> sheets = SheetsOf(scene);
  std::vector<float> of;
  for (const std::size_t sheet : SheetOfRows(scene)) of.push_back(ThermalOf(sheets[sheet], scene.thermal).thickness_m);
  return of;
}

}  // namespace fulcrum
