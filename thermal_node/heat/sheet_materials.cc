#include "thermal_node/heat/sheet_materials.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/sheet_heat.h"

namespace fulcrum::thermal {
namespace {

bool ShareMaterial(const SheetPart& a, const SheetPart& b, const ThermalParams& params) {
  if (IsSpanned(a) || IsSpanned(b)) return false;
  const ThermalParams p = ThermalOf(a, params), q = ThermalOf(b, params);
  return p.thickness_m == q.thickness_m && p.conductivity_W_mK == q.conductivity_W_mK && p.sigma_S_m == q.sigma_S_m;
}

/// With air on both sides neither heat nor current leaves downward.
Material MakeOne(const SheetPart& sheet, const ThermalParams& of_scene, Material (*make)(const ThermalParams&)) {
  ThermalParams params = ThermalOf(sheet, of_scene);
  if (!IsSpanned(sheet)) return make(params);
  params.h_below_W_m2K = params.h_tented_W_m2K;
  Material material = make(params);
  material.spanned = true;
  material.leak_S_m2 = 0;
  return material;
}

/// visit(number of a tile) for the tiles that a cell of the grid touches.
template <class Visit>
void ForTilesOf(const Sheet& sheet, const SheetScene& scene, Index row, Index col, const Visit& visit) {
  const Vec2f* at = &scene.membrane_material[row * scene.membrane.cols + col];
  const Vec2f* below = at + scene.membrane.cols;
  const CellIndex low = sheet.CellOf(at[0].cwiseMin(at[1]).cwiseMin(below[0]).cwiseMin(below[1]));
  const CellIndex high = sheet.CellOf(at[0].cwiseMax(at[1]).cwiseMax(below[0]).cwiseMax(below[1]));
  for (int ty = std::max(low.iy, 0) / kTile; ty <= std::min(high.iy, sheet.ny - 1) / kTile; ++ty) {
    for (int tx = std::max(low.ix, 0) / kTile; tx <= std::min(high.ix, sheet.nx - 1) / kTile; ++tx) {
      visit(static_cast<std::size_t>(ty * sheet.tiles_x + tx));
    }
  }
}

/// Gives tiles without tissue the material of the nearest that has some.
void SpreadMaterials(std::uint8_t none, Sheet* sheet) {
  std::vector<std::uint8_t>& of = sheet->material_of_tile;
  for (bool more = true; more;) {
    more = false;
    const std::vector<std::uint8_t> before = of;
    for (int k = 0; k < sheet->tile_count(); ++k) {
      if (before[k] != none) continue;
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        const int x = k % sheet->tiles_x + dx, y = k / sheet->tiles_x + dy;
        if (x < 0 || y < 0 || x >= sheet->tiles_x || y >= sheet->tiles_y) continue;
        if (const std::uint8_t there = before[y * sheet->tiles_x + x]; there != none) of[k] = there;
      }
      more = more || of[k] != none;
    }
  }
}

void SetMaterialOfTiles(const SheetScene& scene, const std::vector<SheetPart>& parts,
                        const std::vector<std::uint8_t>& material, Sheet* sheet) {
  constexpr std::uint8_t kNone = 0xff;
  sheet->material_of_tile.assign(static_cast<std::size_t>(sheet->tile_count()), kNone);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const SheetPart& part = parts[i];
    const auto take = [&](std::size_t tile) {
      std::uint8_t& of = sheet->material_of_tile[tile];
      if (of != kNone && of != material[i]) {
        throw InputError("scene '" + std::string(scene.name) + "': sheet '" + part.name + "' shares a tile of " +
                         std::to_string(kTile) + " cells with a sheet of another thickness, conductivity or support; " +
                         "valid: thermal.cell_um below " + std::to_string(std::lround(1e6f * sheet->cell_m)) +
                         ", or sheets farther apart in the atlas");
      }
      of = material[i];
    };
    for (Index row = part.first_row; row + 1 < part.first_row + part.rows; ++row) {
      for (Index col = 0; col + 1 < part.cols; ++col) ForTilesOf(*sheet, scene, row, col, take);
    }
  }
  SpreadMaterials(kNone, sheet);
}

/// Adds the cells along a row of nodes, half a cell towards the row `inward` of it.
void AddEnd(const SheetScene& scene, const SheetPart& part, Index row, Index inward, const Sheet& sheet, Band* band) {
  const Vec2f* at = &scene.membrane_material[row * scene.membrane.cols];
  const Vec2f* next = &scene.membrane_material[inward * scene.membrane.cols];
  for (Index c = 0; c + 1 < part.cols; ++c) {
    const Vec2f step = at[c + 1] - at[c], in = 0.5f * sheet.cell_m * (next[c] - at[c]).normalized();
    const int count = std::max(1, static_cast<int>(std::ceil(2.0f * step.norm() / sheet.cell_m)));
    for (int n = 0; n <= count; ++n) {
      const CellIndex cell = sheet.CellOf(at[c] + static_cast<float>(n) / static_cast<float>(count) * step + in);
      if (sheet.Contains(cell) && !sheet.IsOutside(cell.ix, cell.iy)) band->ends.push_back(cell);
    }
  }
}

Band BandOf(const SheetScene& scene, const SheetPart& part, const Sheet& sheet) {
  const Index cols = scene.membrane.cols, last_row = part.first_row + part.rows - 1;
  const auto mean = [&](Index row, Index col, Index count, Index stride) {
    Vec2f sum = Vec2f::Zero();
    for (Index n = 0; n < count; ++n) sum += scene.membrane_material[row * cols + col + n * stride];
    return Vec2f(sum / static_cast<float>(count));
  };
  Band band;
  band.low = {mean(part.first_row, 0, part.rows, cols).x(), mean(part.first_row, 0, part.cols, 1).y()};
  const Vec2f high(mean(part.first_row, part.cols - 1, part.rows, cols).x(), mean(last_row, 0, part.cols, 1).y());
  band.size = (high - band.low).cwiseMax(sheet.cell_m);
  AddEnd(scene, part, part.first_row, part.first_row + 1, sheet, &band);
  AddEnd(scene, part, last_row, last_row - 1, sheet, &band);
  const auto before = [](const CellIndex& a, const CellIndex& b) {
    return std::pair(a.iy, a.ix) < std::pair(b.iy, b.ix);
  };
  std::sort(band.ends.begin(), band.ends.end(), before);
  band.ends.erase(std::unique(band.ends.begin(), band.ends.end()), band.ends.end());
  return band;
}

}  // namespace

std::vector<std::uint8_t> MaterialOfSheets(const SheetScene& scene) {
  const std::vector<SheetPart> sheets = SheetsOf(scene);
  std::vector<std::uint8_t> of;
  std::uint8_t next = 0;
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    std::size_t same = 0;
    while (same < i && !ShareMaterial(sheets[same], sheets[i], scene.thermal)) ++same;
    of.push_back(same < i ? of[same] : next++);
  }
  return of;
}

std::vector<Material> MakeMaterials(const SheetScene& scene, const ThermalParams& params,
                                    Material (*make)(const ThermalParams&)) {
  if (scene.sheets.empty()) return {make(params)};
  const std::vector<SheetPart> sheets = SheetsOf(scene);
  const std::vector<std::uint8_t> of = MaterialOfSheets(scene);
  std::vector<Material> materials;
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    if (of[i] < materials.size()) continue;
    try {
      materials.push_back(MakeOne(sheets[i], params, make));
    } catch (const InputError& error) {
      throw InputError("sheet '" + std::string(sheets[i].name) + "': " + error.what());
    }
  }
  return materials;
}

void AddMaterials(const SheetScene& scene, Sheet* sheet) {
  const std::vector<SheetPart> parts = SheetsOf(scene);
  const std::vector<std::uint8_t> material = MaterialOfSheets(scene);
  sheet->materials = 1 + *std::max_element(material.begin(), material.end());
  if (sheet->materials > 1) SetMaterialOfTiles(scene, parts, material, sheet);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!IsSpanned(parts[i])) continue;
    sheet->bands.push_back(BandOf(scene, parts[i], *sheet));
    sheet->bands.back().material = material[i];
  }
}

}  // namespace fulcrum::thermal
