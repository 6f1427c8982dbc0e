#include "thermal_node/paper/paper_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "services/base/core/sheets.h"
#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

constexpr int kTextureTiles = kTexture / kTile;

/// Adds scale * heat up to the value `limit`.
FULCRUM_WIDE
void AddHeat(float scale, float limit, const float* __restrict heat, float* __restrict enthalpy) {
  for (int i = 0; i < kTile; ++i) {
    const float asked = scale * heat[i], room = limit - enthalpy[i];
    const float most = room > 0.0f ? room : 0.0f;
    enthalpy[i] += asked < most ? asked : most;
  }
}

/// Node positions on the far border belong to the last cell, not to one beyond the sheet.
int CellCoordinate(float x, int n) { return std::clamp(static_cast<int>(std::floor(x)), 0, n - 1); }

}  // namespace

Material MakePaperMaterial(const ThermalParams& params) {
  Material m = MakeMaterial(params);
  m.rc_dry = m.rc_wet;
  m.k_wet = m.k_dry = kPaperDiffusivity_m2_s * m.rc_wet;
  m.theta_boil = kThetaPlausible;  // never reached: no latent heat
  m.sigma_per_K = 0;
  m.leak_S_m2 = 0;
  if (params.as == PaperForm::kPrinted) {
    m.rc_wet = m.rc_dry = 1e6f * kPrintedDensity_g_cm3 * kPrintedHeatCapacity_J_gK;
    m.k_wet = m.k_dry = kPrintedConductivity_W_mK;
    m.sigma = kPrintedSigma_S_m;
    m.loss_resting = m.loss_tented = 0;
  }
  return m;
}

PaperModel::PaperModel(const SheetScene& scene, const Sheet& sheet)
    : as_(scene.thermal.as),
      h_border_W_m2K_(scene.thermal.h_top_W_m2K),
      rows_(scene.membrane.rows),
      cols_(scene.membrane.cols),
      nx_(sheet.nx),
      ny_(sheet.ny) {
  const Vec2f origin(static_cast<float>(sheet.origin_x), static_cast<float>(sheet.origin_y));
  node_.reserve(scene.membrane_material.size());
  for (const Vec2f& p : scene.membrane_material) node_.push_back(p / sheet.cell_m - origin);
  bin_offset_.assign(sheet.tile_count() + 1, 0);
  const auto tile_of = [&](Index node) {
    const CellIndex cell = CellOfNode(node);
    return (cell.iy / kTile) * sheet.tiles_x + cell.ix / kTile;
  };
  const auto nodes = static_cast<Index>(node_.size());
  const std::vector<std::uint8_t> absent = AbsentNodes(scene);
  for (Index n = 0; n < nodes; ++n) bin_offset_[tile_of(n) + 1] += absent[n] == 0 ? 1 : 0;
  for (std::size_t i = 1; i < bin_offset_.size(); ++i) bin_offset_[i] += bin_offset_[i - 1];
  bin_node_.resize(bin_offset_.back());
  std::vector<Index> next(bin_offset_.begin(), bin_offset_.end() - 1);
  for (Index n = 0; n < nodes; ++n) {
    if (absent[n] == 0) bin_node_[next[tile_of(n)]++] = n;
  }
  invalid_.reserve(1024);
  if (as_ == PaperForm::kPrinted) FindBorder(sheet);
}

void PaperModel::FindBorder(const Sheet& sheet) {
  const auto outside = [&](int ix, int iy) { return !sheet.Contains({ix, iy}) || sheet.IsOutside(ix, iy); };
  border_.resize(sheet.tile_count());
  for (int iy = 0; iy < ny_; ++iy) {
    for (int ix = 0; ix < nx_; ++ix) {
      if (outside(ix, iy)) continue;
      int faces = 0;
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) faces += outside(ix + dx, iy + dy);
      if (faces == 0) continue;
      border_[iy / kTile * sheet.tiles_x + ix / kTile].push_back({(iy % kTile) * kTile + ix % kTile, faces});
    }
  }
}

void PaperModel::CoolBorder(HeatField* field, float dt_s, Ledger* ledger) const {
  if (border_.empty()) return;
  const Material& material = field->material();
  const float rate = h_border_W_m2K_ / (material.rc_wet * material.cell_m);  // Of a cell with one face outside [1/s].
  for (Tile* tile : field->awake()) {
    const std::vector<BorderCell>& cells = border_[tile->index];
    if (cells.empty()) continue;
    const double before = tile->Heat();
    for (const auto& [cell, faces] : cells) {
      tile->state.enthalpy[cell] *= std::exp(-rate * static_cast<float>(faces) * dt_s);
    }
    ledger->lost += before - tile->Heat();
    field->RefreshTheta(tile, ledger);
  }
}

CellIndex PaperModel::CellOfNode(Index node) const {
  return {CellCoordinate(node_[node].x(), nx_), CellCoordinate(node_[node].y(), ny_)};
}

void PaperModel::MoveTo(CellIndex corner) {
  if (corner == corner_) return;
  const int di = corner.ix - corner_.ix, dj = corner.iy - corner_.iy;
  // After a touch-down elsewhere the last potential is no useful start value.
  const bool near = std::abs(di) < kTexture / 4 && std::abs(dj) < kTexture / 4;
  near ? potential_.Shift(di, dj) : potential_.Clear();
  corner_ = corner;
}

void PaperModel::LoadTissue(const HeatField& field, int material) {
  const Sheet& sheet = field.sheet();
  for (int j = 0; j < kTexture; ++j) {
    const std::span<float> row = potential_.tissue_row(j);
    const int iy = corner_.iy + j;
    for (int i = 0; i < kTexture; i += kTile) {
      const int ix = corner_.ix + i;
      const bool beyond = ix < 0 || iy < 0 || ix >= sheet.tiles_x * kTile || iy >= sheet.tiles_y * kTile ||
                          sheet.MaterialOf(ix / kTile, iy / kTile) != material;
      const Tile* tile = beyond ? nullptr : field.Find(ix / kTile, iy / kTile);
      for (int n = 0; n < kTile; ++n) {
        bool tissue = !beyond;
        if (tile != nullptr && as_ == PaperForm::kCorrected) {
          tissue = (tile->state.flags[(iy % kTile) * kTile + n] & kNoTissue) == 0;
        } else if (tissue) {
          tissue = !sheet.IsOutside(ix + n, iy);
        }
        row[i + n] = tissue ? 1.0f : 0.0f;
      }
    }
  }
}

void PaperModel::PlaceElectrode(const Sheet& sheet, const Electrode& electrode) {
  const CellIndex centre = sheet.CellOf(electrode.tip);
  const int reach = static_cast<int>(electrode.radius_m / sheet.cell_m) + 1;
  for (int iy = centre.iy - reach; iy <= centre.iy + reach; ++iy) {
    for (int ix = centre.ix - reach; ix <= centre.ix + reach; ++ix) {
      const CellIndex cell{ix, iy};
      const bool touched = cell == centre || (sheet.CentreOf(cell) - electrode.tip).norm() <= electrode.radius_m;
      const int i = ix - corner_.ix, j = iy - corner_.iy;
      if (touched && i >= 0 && j >= 0 && i < kTexture && j < kTexture) potential_.SetElectrode(i, j);
    }
  }
}

void PaperModel::Heat(HeatField* field, const Electrode& electrode, float dt_s, Ledger* ledger) {
  const Sheet& sheet = field->sheet();
  // The texture moves by whole tiles; the tip is then at least 3.5 of the 8 tiles from its border.
  const CellIndex centre = sheet.CellOf(electrode.tip);
  const int number = sheet.MaterialAt(centre);
  const Material& material = field->materials()[static_cast<std::size_t>(number)];
  const auto corner = [](int cell) {
    return (static_cast<int>(std::floor((static_cast<float>(cell) + 0.5f * kTile) / kTile)) - kTextureTiles / 2) *
           kTile;
  };
  MoveTo({corner(centre.ix), corner(centre.iy)});
  LoadTissue(*field, number);
  PlaceElectrode(sheet, electrode);
  potential_.Relax(kPaperSweeps);
  const float sheet_S = material.sigma * material.thickness_m;
  const float limit = kPaperThetaMax * material.rc_wet;
  const float watt = sheet_S * electrode.voltage_V * electrode.voltage_V;  // power at a relative conductance of 1
  ledger->generator += static_cast<double>(watt) * dt_s * potential_.TakeConductance();
  for (int ty = 0; ty < kTextureTiles; ++ty) {
    alignas(64) std::array<float, static_cast<std::size_t>(kTile) * kTexture> heat;
    for (int j = 0; j < kTile; ++j) {
      potential_.HeatOfRow(ty * kTile + j, std::span(heat).subspan(j * kTexture, kTexture));
    }
    for (int tx = 0; tx < kTextureTiles; ++tx) {
      const int ix = corner_.ix + tx * kTile, iy = corner_.iy + ty * kTile;
      const bool is_other = ix < 0 || iy < 0 || sheet.MaterialOf(ix / kTile, iy / kTile) != number;
      Tile* tile = is_other ? nullptr : field->Wake(ix / kTile, iy / kTile);
      if (tile == nullptr) continue;
      tile->state.tented = electrode.tented ? 1 : 0;
      // The texture is flat, as in the paper; the ledger counts the heat with the areas of the curved sheet.
      const float scale = watt * dt_s / tile->flat_volume;
      field->RefreshTheta(tile, ledger);  // Quarantines bad cells before the ledger reads them.
      const double before = tile->Heat();
      for (int j = 0; j < kTile; ++j) {
        AddHeat(scale, limit, &heat[j * kTexture + tx * kTile], &tile->state.enthalpy[j * kTile]);
      }
      ledger->joule += tile->Heat() - before;
      field->RefreshTheta(tile, ledger);
    }
  }
}

/// Visits the up to eight nodes around one.
template <class Visit>
void PaperModel::ForNeighbours(Index node, const Visit& visit) const {
  const auto row = static_cast<int>(node / cols_), col = static_cast<int>(node % cols_);
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, static_cast<int>(rows_) - 1); ++r) {
    for (int c = std::max(col - 1, 0); c <= std::min(col + 1, static_cast<int>(cols_) - 1); ++c) {
      const Index other = static_cast<Index>(r) * cols_ + static_cast<Index>(c);
      if (other != node) visit(other);
    }
  }
}

void PaperModel::TakeOutCellsOf(Index node, HeatField* field, Ledger* ledger, RemovedBox* removed) const {
  const Vec2f at = node_[node];
  float farthest = 0;
  ForNeighbours(node, [&](Index other) { farthest = std::max(farthest, (node_[other] - at).norm()); });
  const int reach = static_cast<int>(std::ceil(0.5f * farthest));
  const CellIndex own = CellOfNode(node);
  for (int iy = std::max(own.iy - reach, 0); iy <= std::min(own.iy + reach, ny_ - 1); ++iy) {
    for (int ix = std::max(own.ix - reach, 0); ix <= std::min(own.ix + reach, nx_ - 1); ++ix) {
      const Vec2f p(static_cast<float>(ix) + 0.5f, static_cast<float>(iy) + 0.5f);
      const float distance2 = (p - at).squaredNorm();
      const bool is_own = CellIndex{ix, iy} == own;
      bool takes = true;
      ForNeighbours(node, [&](Index other) {
        // The cell that holds another node is removed with that node only, wherever its centre lies.
        const bool farther = distance2 > (p - node_[other]).squaredNorm();
        takes = takes && !farther && !(CellOfNode(other) == CellIndex{ix, iy});
      });
      Tile* tile = takes || is_own ? field->Wake(ix / kTile, iy / kTile) : nullptr;
      if (tile == nullptr) continue;
      const int cell = (iy % kTile) * kTile + ix % kTile;
      const std::uint8_t flags = tile->state.flags[cell];
      // The removed flag of a node's own cell marks that the rule has been applied to the node, so a quarantined own
      // cell gets the flag too.
      if ((flags & (kRemoved | kOutside)) != 0 || ((flags & kQuarantined) != 0 && !is_own)) continue;
      field->TakeOut(tile, cell, kRemoved, &ledger->removed);
      removed->low = {std::min(removed->low.ix, ix), std::min(removed->low.iy, iy)};
      removed->high = {std::max(removed->high.ix, ix), std::max(removed->high.iy, iy)};
    }
  }
}

RemovedBox PaperModel::RemoveNodes(HeatField* field, MeshTopology* topology, Ledger* ledger) {
  const float theta_vaporised = kBoiling_C - field->material().body_C;
  invalid_.clear();
  for (const Tile* tile : field->awake()) {
    if (tile->theta_max < theta_vaporised) continue;
    for (Index n = bin_offset_[tile->index]; n < bin_offset_[tile->index + 1]; ++n) {
      const CellIndex at = CellOfNode(bin_node_[n]);
      const int i = at.ix % kTile, j = at.iy % kTile;
      const std::uint8_t flags = tile->state.flags[j * kTile + i];
      if ((flags & (kRemoved | kOutside)) != 0) continue;
      const bool bad = (flags & kQuarantined) != 0;
      if (bad || tile->theta[ThetaIndex(i, j)] >= theta_vaporised) invalid_.push_back(bin_node_[n]);
    }
  }
  RemovedBox removed;
  const auto is_invalid = [&](Index node) {
    const CellIndex at = CellOfNode(node);
    const Tile* tile = field->Find(at.ix / kTile, at.iy / kTile);
    return tile != nullptr && (tile->state.flags[(at.iy % kTile) * kTile + at.ix % kTile] & kRemoved) != 0;
  };
  for (const Index node : invalid_) {
    TakeOutCellsOf(node, field, ledger, &removed);
    if (as_ == PaperForm::kPrinted) {
      topology->StageInvalidNode(node, is_invalid);
    } else {
      topology->StageInvalidNode(node, [](Index) { return true; });
    }
  }
  if (!removed.empty()) {
    for (Tile* tile : field->awake()) {
      if (tile->material_stale) field->RefreshTheta(tile, ledger);
    }
  }
  return removed;
}

}  // namespace fulcrum::thermal
