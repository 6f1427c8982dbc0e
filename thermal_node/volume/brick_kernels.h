// Kernels of the volume's explicit step, by layers of a brick.
//
//   h_c <- h_c + sum over the six faces of C_f (theta_n - theta_c) - loss theta_c + q,   C_f = dt G_f / (rc V)
//   theta = min(h, boil) + max(h - boil - latent, 0)
//
// h enthalpy over rc [K], theta temperature above body temperature [K], n neighbour of cell c at face f, G_f thermal
// conductance of the face [W/K], rc heat capacity [J/(m^3 K)], V volume of a cell [m^3], loss dt times the perfusion
// over rc [1], q heat of the leak current over rc [K], boil boiling point above body temperature [K], latent latent
// heat over rc [K].
//
// Stencil: seven points, two each along s, t and depth. The faces at the border of the warm box are closed; the upper
// face of layer 0, the lid, has the sheet's flux instead.
#pragma once

#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/volume/brick.h"

namespace fulcrum::thermal {

/// Factors of one explicit step in layer k: dt * conductance / (rc * volume) of the faces along s, along t, above and
/// below, dt times the sink, and kelvins per J/m^3 of source.
struct LayerStep {
  float along_s = 0, along_t = 0, above = 0, below = 0, loss = 0, source = 0;
};

/// One step of conduction, perfusion and source in layer k. Reads theta and its halos, changes the enthalpy only.
void ConductLayer(Brick* brick, int k, const LayerStep& step);
/// Adds the heat that enters layer 0 through the lid in dt. Returns the sum over the columns [K].
double ApplyLid(Brick* brick, float dt_s);
/// Computes theta of layer k, its sum and the maxima of its pairs of rows; boiling takes `latent_K` at `boil` [K].
void RefreshLayer(Brick* brick, int k, float boil, float latent_K);

/// Adds dt of damage to `count` cells of a row where theta >= kDamageStart; true when a cell of it is dead, Omega >= 1.
bool DamageRow(const float* theta, float* omega, int count, DamageRate rate, float dt_s);

}  // namespace fulcrum::thermal
