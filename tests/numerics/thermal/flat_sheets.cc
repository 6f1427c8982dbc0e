#include "tests/numerics/thermal/flat_sheets.h"

#include <cmath>
#include <cstdio>

#include "thermal_node/heat/sheet_materials.h"

namespace fulcrum::thermal {

scene::SceneData FlatSheets(std::span<const FlatSheet> sheets, float spacing_m) {
  scene::SceneData data;
  data.fixed.hash = 42;
  MembraneGrid& grid = data.fixed.membrane;
  std::uint32_t row = 0;
  for (const FlatSheet& sheet : sheets) {
    SheetPart& part = data.sheets.emplace_back();
    std::snprintf(part.name, sizeof(part.name), "sheet %zu", data.sheets.size());
    part.first_row = row;
    part.rows = sheet.rows;
    part.cols = sheet.cols;
    part.over = sheet.over;
    part.thickness_m = sheet.heat.thickness_m;
    part.conductivity_W_mK = sheet.heat.conductivity_W_mK;
    part.sigma_S_m = sheet.heat.sigma_S_m;
    grid.cols = std::max(grid.cols, sheet.cols);
    grid.rows = row + sheet.rows;
    row = (grid.rows + 2 * kRowsBetweenSheets - 1) / kRowsBetweenSheets * kRowsBetweenSheets;
  }
  std::size_t of = 0;
  for (std::uint32_t r = 0; r < grid.rows; ++r) {
    if (of + 1 < sheets.size() && r >= data.sheets[of + 1].first_row) ++of;
    const std::uint32_t first = data.sheets[of].first_row, rows = sheets[of].rows, cols = sheets[of].cols;
    for (std::uint32_t c = 0; c < grid.cols; ++c) {
      const bool own = r - first < rows && c < cols, next = own && c + 1 < cols, below = own && r + 1 < first + rows;
      const Vec2f p(sheets[of].x_m + static_cast<float>(own ? c : 0) * spacing_m,
                    static_cast<float>(own ? r - first : 0) * spacing_m);
      data.membrane_material.push_back(p);
      data.rest_position.push_back(Vec3f(p.x(), p.y(), 0));
      data.inverse_mass.push_back(own ? 1.0f : 0.0f);
      data.membrane_rest_length.push_back(next ? spacing_m : 0);
      data.membrane_rest_length.push_back(below ? spacing_m : 0);
      data.membrane_rest_length.push_back(next && below ? spacing_m * std::sqrt(2.0f) : 0);
    }
  }
  return data;
}

double BandResistance(const ThermalParams& params, const SheetHeat& heat, float width_m, float length_m, float at_m,
                      float radius_m) {
  constexpr float kSpacing_m = 5e-4f;
  const auto nodes = [](float length) { return static_cast<std::uint32_t>(std::lround(length / kSpacing_m)) + 1; };
  scene::SceneData data = OneSheet({nodes(length_m), nodes(width_m), 0, kNoIndex, heat}, kSpacing_m);
  data.fixed.thermal = params;
  const SceneView scene = data.View();
  HeatField field(MakeSheet(scene), MakeMaterials(scene, scene.thermal, MakeMaterial));
  SourceWindow window(field.materials(), field.sheet());
  window.tolerance = 1e-4f;
  TipPath path;
  path.half = {0.5f * width_m, 0};
  path.from = path.to = {0.5f * width_m, at_m};
  path.radius_m = radius_m;
  path.tented = true;
  Ledger ledger;
  // One volt for a moment: the tissue stays as it is.
  window.Run(&field, path, {.power_W = 1, .v_max_V = 1, .i_max_A = 1, .remove_theta = 1e3f, .arc_m = 0}, 1e-6f,
             &ledger);
  return static_cast<double>(window.stats().voltage_V / window.stats().current_A);
}

double StripResistance(const ThermalParams& params, const SheetHeat& heat, double width_m, double length_m, double at_m,
                       double radius_m) {
  const double d = static_cast<double>(heat.thickness_m > 0.0f ? heat.thickness_m : params.thickness_m);
  const double sigma = static_cast<double>(heat.sigma_S_m > 0.0f ? heat.sigma_S_m : params.sigma_S_m);
  const double fin = 1 / (std::tanh(radius_m * std::sqrt(2.0) / d) * std::sqrt(2.0) * sigma * width_m);
  const auto side = [&](double length) { return fin + (length - radius_m) / (sigma * d * width_m); };
  return 1 / (1 / side(at_m) + 1 / side(length_m - at_m));
}

}  // namespace fulcrum::thermal
