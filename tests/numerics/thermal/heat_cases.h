// Conduction against exact solutions, at several cell sizes and steps, for tests and benchmark.
#pragma once

#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

/// Sets theta of every tissue cell from f(x, y), at cell centres [m]; wakes all.
template <class F>
void Fill(HeatField* field, const F& f) {
  const Sheet& sheet = field->sheet();
  Ledger ledger;
  for (int ty = 0; ty < sheet.tiles_y; ++ty) {
    for (int tx = 0; tx < sheet.tiles_x; ++tx) {
      Tile* tile = field->Wake(tx, ty);
      for (int k = 0; k < kTileCells; ++k) {
        if ((tile->state.flags[k] & kNoTissue) != 0) continue;
        const Vec2f p = sheet.CentreOf({tx * kTile + k % kTile, ty * kTile + k / kTile});
        tile->state.enthalpy[k] =
            static_cast<float>(f(p.x(), p.y())) * field->material().HeatCapacity(tile->state.water[k]);
      }
      field->RefreshTheta(tile, &ledger);
    }
  }
}

/// Visits the theta of every tissue cell: visit(theta, x, y).
template <class F>
void ForCells(const HeatField& field, const F& visit) {
  for (const Tile* tile : field.awake()) {
    for (int k = 0; k < kTileCells; ++k) {
      if ((tile->state.flags[k] & kNoTissue) != 0) continue;
      const Vec2f p = field.sheet().CentreOf({tile->tx * kTile + k % kTile, tile->ty * kTile + k / kTile});
      visit(tile->theta[ThetaIndex(k % kTile, k / kTile)], p.x(), p.y());
    }
  }
}

/// Largest error of the mode cos(pi x / L) cos(2 pi y / L) on a square with insulated borders and losses through both
/// faces after 2 s, relative to its amplitude.
[[nodiscard]] double ModeError(float cell_m, float dt_s);

/// Largest error over the largest value of a solution made up for water, and with it conductivity and heat capacity,
/// that vary by half over the sheet; its source is added half before and half after each step.
[[nodiscard]] double VariableError(float cell_m, float dt_s);

/// Largest error over the largest value of a bump that fades on a patch of a sphere of 8 mm radius, in coordinates that
/// shear by 27 degrees.
[[nodiscard]] double SphereError(float cell_m, float dt_s);

/// A front of boiling that a wall at 350 K above body temperature drives into wet tissue: its depth after `time_s`
/// against Neumann's solution of the two-phase Stefan problem (Carslaw and Jaeger, Conduction of Heat in Solids, 11.2),
/// relative. Depth is the share of water gone times the length. Steps are as short as the cells ask for, so that the
/// wall is held.
[[nodiscard]] double StefanError(float cell_m, double time_s = 1);

/// Order of the step in time on the same problem, from the differences of steps of 48, 24 and 12 ms on one grid.
[[nodiscard]] double TimeOrder();

}  // namespace fulcrum::thermal
