#include "thermal_node/volume/sheet_contact.h"

#include <algorithm>
#include <cmath>

#include "thermal_node/heat/wide.h"

namespace fulcrum::thermal {
namespace {

/// Three rows of the sheet above two rows of columns.
struct alignas(64) SheetRows {
  float theta[3][kBrickSpan];
  float flow[3][kBrickSpan];   ///< Conductance of the cell to the volume [W/K].
  float decay[3][kBrickSpan];  ///< The same over the cell's volume [W/(K m^3)].
  float below[3][kBrickSpan];  ///< Temperature of the columns below a cell, averaged over the cell [K].
};

/// lid_flux = sum flow theta, lid_rate = sum flow of the cells above each column, times `scale`.
FULCRUM_WIDE
void ToColumns(const SheetRows& rows, float scale, float* flux, float* rate) {
  alignas(64) float warm[2][kBrickSpan], plain[2][kBrickSpan];
  for (int i = 0; i < kBrickSpan; ++i) {
    const float shared = 0.5f * rows.flow[1][i], shared_warm = shared * rows.theta[1][i];
    plain[0][i] = rows.flow[0][i] + shared;
    plain[1][i] = rows.flow[2][i] + shared;
    warm[0][i] = rows.flow[0][i] * rows.theta[0][i] + shared_warm;
    warm[1][i] = rows.flow[2][i] * rows.theta[2][i] + shared_warm;
  }
  for (int half = 0; half < 2; ++half) {
    for (int n = 0; n < kBrick / 2; ++n) {
      const float* w = &warm[half][3 * n];
      const float* p = &plain[half][3 * n];
      const int out = half * kBrick + 2 * n;
      flux[out] = scale * (w[0] + 0.5f * w[1]);
      flux[out + 1] = scale * (w[2] + 0.5f * w[1]);
      rate[out] = scale * (p[0] + 0.5f * p[1]);
      rate[out + 1] = scale * (p[2] + 0.5f * p[1]);
    }
  }
}

FULCRUM_WIDE
void FromColumns(const float* upper, const float* lower, SheetRows* rows) {
  for (int n = 0; n < kBrick / 2; ++n) {
    const float u0 = upper[2 * n], u1 = upper[2 * n + 1], l0 = lower[2 * n], l1 = lower[2 * n + 1];
    float* top = &rows->below[0][3 * n];
    float* bottom = &rows->below[2][3 * n];
    top[0] = u0;
    top[1] = 0.5f * (u0 + u1);
    top[2] = u1;
    bottom[0] = l0;
    bottom[1] = 0.5f * (l0 + l1);
    bottom[2] = l1;
  }
  for (int i = 0; i < kBrickSpan; ++i) rows->below[1][i] = 0.5f * (rows->below[0][i] + rows->below[2][i]);
}

FULCRUM_WIDE
void Cool(float* enthalpy, const float* theta, const float* decay, const float* below, float dt_s) {
  for (int i = 0; i < kTile; ++i) enthalpy[i] -= dt_s * decay[i] * (theta[i] - below[i]);
}

bool IsApart(const Tile& tile) { return tile.state.tented != 0 || tile.material->spanned; }

/// True if the tile takes part in the exchange.
bool Touches(const Tile* tile) { return tile != nullptr && tile->state.awake != 0 && !IsApart(*tile); }

}  // namespace

SheetContact::SheetContact(std::span<const Material> sheets, const VolumeMaterial& volume)
    : half_layer_(1.0f / volume.face[0]) {
  for (const Material& sheet : sheets) {
    const float largest = 1.0f / (half_layer_ + 0.5f * sheet.thickness_m / std::max(sheet.k_wet, sheet.k_dry));
    rate_ = std::max(rate_, largest / (sheet.thickness_m * sheet.rc_dry));
  }
}

float SheetContact::Conductance(const Tile& tile, int cell) const {
  if ((tile.state.flags[cell] & kNoTissue) != 0) return 0;
  const float half_sheet =
      0.5f * tile.material->thickness_m / tile.material->ThermalConductivity(tile.state.water[cell]);
  return 1.0f / (half_layer_ + half_sheet);
}

void SheetContact::Wake(HeatField* sheet, VolumeField* volume) const {
  for (const Tile* tile : sheet->awake()) {
    if (tile->theta_max < kVolumeWakeTheta || IsApart(*tile)) continue;
    int first = kTile, last = -1;
    for (int j = 0; j < kTile; ++j) {
      const float* theta = &tile->theta[ThetaIndex(0, j)];
      if (*std::max_element(theta, theta + kTile) < kVolumeWakeTheta) continue;
      first = std::min(first, j);
      last = j;
    }
    if (last < 0) continue;
    const int top = tile->ty % kBrickTiles * kTile;
    const int left = tile->tx % kBrickTiles * kTile;
    const WarmBox need{left * 2 / 3, ((left + kTile - 1) * 2 + 1) / 3 + 1, (top + first) * 2 / 3,
                       ((top + last) * 2 + 1) / 3 + 1, 1};
    Brick* brick = volume->Wake(tile->tx / kBrickTiles, tile->ty / kBrickTiles, need);
    if (brick != nullptr) brick->held = true;
  }
  for (const Brick* brick : volume->awake()) WakeSheetAbove(*brick, sheet);
}

void SheetContact::WakeSheetAbove(const Brick& brick, HeatField* sheet) const {
  bool warm[kBrickTiles][kBrickTiles] = {};
  // A column lies below a whole cell of the sheet and half of the next; these may be in two tiles.
  const auto tile_of = [](int column, int half) { return (3 * column + 2 * half) / 2 / kTile; };
  for (int j = brick.box.row0; j < brick.box.row1; ++j) {
    if (brick.pair_max[j / kBoxRows] <= kVolumeWakeTheta) continue;
    const float* theta = &brick.theta[BrickThetaIndex(0, j, 0)];
    for (int i = brick.box.col0; i < brick.box.col1; ++i) {
      if (theta[i] <= kVolumeWakeTheta) continue;
      for (int n = 0; n < 4; ++n) warm[tile_of(j, n / 2)][tile_of(i, n % 2)] = true;
    }
  }
  for (int n = 0; n < kBrickTiles * kBrickTiles; ++n) {
    if (!warm[n / kBrickTiles][n % kBrickTiles]) continue;
    const int tx = brick.bx * kBrickTiles + n % kBrickTiles, ty = brick.by * kBrickTiles + n / kBrickTiles;
    const Tile* there = sheet->Find(tx, ty);
    const auto material = static_cast<std::size_t>(sheet->sheet().MaterialOf(tx, ty));
    if (sheet->materials()[material].spanned || (there != nullptr && IsApart(*there))) continue;
    if (Tile* tile = sheet->Wake(tx, ty)) tile->held = true;
  }
}

void SheetContact::Exchange(float dt_s, HeatField* sheet, const VolumeMaterial& volume, Brick* brick) const {
  SheetRows rows;
  const float scale = 1.0f / (volume.rc[0] * brick->volume);
  for (int j = brick->box.row0; j < brick->box.row1; j += 2) {
    const int y0 = j / 2 * 3;
    for (int r = 0; r < 3; ++r) {
      const int ty = brick->by * kBrickTiles + (y0 + r) / kTile, row = (y0 + r) % kTile;
      for (int n = 0; n < kBrickTiles; ++n) {
        const Tile* tile = sheet->Find(brick->bx * kBrickTiles + n, ty);
        const int to = n * kTile;
        if (!Touches(tile)) {
          std::fill_n(&rows.theta[r][to], kTile, 0.0f);
          std::fill_n(&rows.flow[r][to], kTile, 0.0f);
          std::fill_n(&rows.decay[r][to], kTile, 0.0f);
          continue;
        }
        std::copy_n(&tile->theta[ThetaIndex(0, row)], kTile, &rows.theta[r][to]);
        for (int i = 0; i < kTile; ++i) {
          const int cell = row * kTile + i;
          const float g = Conductance(*tile, cell);
          rows.flow[r][to + i] = g * tile->Volume(cell) / tile->material->thickness_m;
          rows.decay[r][to + i] = g / tile->material->thickness_m;
        }
      }
    }
    // Columns outside the box have no contact.
    const int first = brick->box.col0 / 2 * 3, last = brick->box.col1 / 2 * 3;
    for (int r = 0; r < 3; ++r) {
      for (float* row : {rows.flow[r], rows.decay[r]}) {
        std::fill(row, row + first, 0.0f);
        std::fill(row + last, row + kBrickSpan, 0.0f);
      }
    }
    ToColumns(rows, scale, &brick->lid_flux[j * kBrick], &brick->lid_rate[j * kBrick]);
    FromColumns(&brick->theta[BrickThetaIndex(0, j, 0)], &brick->theta[BrickThetaIndex(0, j + 1, 0)], &rows);
    for (int r = 0; r < 3; ++r) {
      const int ty = brick->by * kBrickTiles + (y0 + r) / kTile, row = (y0 + r) % kTile;
      for (int n = 0; n < kBrickTiles; ++n) {
        Tile* tile = sheet->Find(brick->bx * kBrickTiles + n, ty);
        if (!Touches(tile)) continue;
        const int at = n * kTile;
        Cool(&tile->state.enthalpy[row * kTile], &rows.theta[r][at], &rows.decay[r][at], &rows.below[r][at], dt_s);
      }
    }
  }
}

int SheetContact::Step(float dt_s, HeatField* sheet, VolumeField* volume, Ledger* ledger) const {
  Wake(sheet, volume);
  if (volume->idle()) return 0;
  const float rate = std::max(volume->Rate(), rate_);
  const int substeps = std::max(1, static_cast<int>(std::ceil(dt_s * rate / kExplicitLimit)));
  const float h = dt_s / static_cast<float>(substeps);
  for (int n = 0; n < substeps; ++n) {
    volume->Spread();
    for (Brick* brick : volume->awake()) Exchange(h, sheet, volume->material(), brick);
    ledger->lost += volume->Advance(h);
    for (Tile* tile : sheet->awake()) {
      if (!IsApart(*tile)) sheet->RefreshTheta(tile, ledger);
    }
  }
  volume->Finish(dt_s);
  return substeps;
}

}  // namespace fulcrum::thermal
