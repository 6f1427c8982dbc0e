// Which nodes and cells of the grid belong to a sheet.
#pragma once

#include <algorithm>
#include <cstring>
#include <vector>

#include "services/base/core/scene_view.h"
#include "services/base/core/solids.h"

namespace fulcrum {

inline constexpr std::size_t kMaxSheets = 16;
/// Rows of the grid between two sheets. Sheets begin at multiples of it, so that no block of rows lies in two of them.
/// What looks farther than this from a node asks SheetOfRows.
inline constexpr std::uint32_t kRowsBetweenSheets = 8;

/// The sheets of a scene; of a scene that lists none the whole grid, if it has one.
[[nodiscard]] inline std::vector<SheetPart> SheetsOf(const SheetScene& scene) {
  if (!scene.sheets.empty()) return {scene.sheets.begin(), scene.sheets.end()};
  if (scene.membrane.node_count() == 0) return {};
  SheetPart whole{"membrane", 0, scene.membrane.rows, scene.membrane.cols, 0};
  return {whole};
}

/// Whether cell (row, col) of the grid is part of a sheet. @pre row + 1 < rows, col + 1 < cols
[[nodiscard]] inline bool HasCell(const SheetScene& scene, std::uint32_t row, std::uint32_t col) {
  if (scene.sheets.empty()) return true;
  return scene.membrane_rest_length[3 * (std::size_t{row} * scene.membrane.cols + col) + 2] > 0.0f;
}

/// The same of the cell of a triangle.
[[nodiscard]] inline bool HasTriangle(const SheetScene& scene, Index triangle) {
  const std::uint32_t cells = scene.membrane.cols - 1;
  return HasCell(scene, triangle / 2 / cells, triangle / 2 % cells);
}

/// By row of the grid: which of SheetsOf it belongs to; a row between two belongs to the one before.
[[nodiscard]] inline std::vector<std::size_t> SheetOfRows(const SheetScene& scene) {
  const std::vector<SheetPart> sheets = SheetsOf(scene);
  std::vector<std::size_t> of(scene.membrane.rows, 0);
  for (std::uint32_t row = 0; row < scene.membrane.rows; ++row) {
    of[row] = row > 0 ? of[row - 1] : 0;
    if (of[row] + 1 < sheets.size() && row >= sheets[of[row] + 1].first_row) ++of[row];
  }
  return of;
}

/// Material of a sheet: its own values, else those of `physics`.
struct SheetProperties {
  float Et_N_per_m, bending_Nm, fat_youngs_modulus_Pa, tear_stretch;
};
[[nodiscard]] inline SheetProperties PropertiesOf(const SheetPart& sheet, const PhysicsParams& physics) {
  const auto own_or = [](float own, float of_scene) { return own > 0.0f ? own : of_scene; };
  return {own_or(sheet.Et_N_per_m, physics.membrane_Et_N_per_m), own_or(sheet.bending_Nm, physics.membrane_bending_Nm),
          own_or(sheet.fat_youngs_modulus_Pa, physics.fat_youngs_modulus_Pa),
          own_or(sheet.tear_stretch, physics.tear_stretch)};
}

/// By row of the grid: the properties of its sheet.
[[nodiscard]] inline std::vector<SheetProperties> PropertiesOfRows(const TissueScene& scene) {
  const std::vector<SheetPart> sheets = SheetsOf(scene);
  std::vector<SheetProperties> of;
  for (const std::size_t sheet : SheetOfRows(scene)) of.push_back(PropertiesOf(sheets[sheet], scene.physics));
  return of;
}

/// By sheet: the body that it moves with, by the number of a solid, else with a number of its own after those. Bodies
/// are at rest or in motion as a whole.
[[nodiscard]] inline std::vector<Index> BodyOfSheets(const TissueScene& scene) {
  std::vector<Index> bodies;
  Index next = SolidCount(scene);
  for (const SheetPart& sheet : SheetsOf(scene)) bodies.push_back(sheet.over < SolidCount(scene) ? sheet.over : next++);
  return bodies;
}

/// By node: 1 where it belongs to no sheet.
[[nodiscard]] inline std::vector<std::uint8_t> AbsentNodes(const SheetScene& scene) {
  std::vector<std::uint8_t> absent(scene.membrane.node_count(), 1);
  for (const SheetPart& sheet : SheetsOf(scene)) {
    for (std::uint32_t row = 0; row < sheet.rows; ++row) {
      const std::size_t first = std::size_t{sheet.first_row + row} * scene.membrane.cols;
      std::fill_n(absent.begin() + static_cast<std::ptrdiff_t>(first), sheet.cols, std::uint8_t{0});
    }
  }
  return absent;
}

}  // namespace fulcrum
