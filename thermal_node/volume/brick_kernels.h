// The hot loops over a brick's layers.
#pragma once

#include "thermal_node/damage/arrhenius.h"
#include "thermal_node/volume/brick.h"

namespace fulcrum::thermal {

/// Factors of one explicit step in layer k: dt * conductance / (rc * volume) of the faces along s, along t, above and
/// below, dt times the sink, and kelvins per J/m^3 of source.
struct LayerStep {
  float along_s = 0, along_t = 0, above = 0, below = 0, loss = 0, source = 0;
};

/// One step of conduction, perfusion and source in layer k from the halos and theta as they are; theta stays.
void ConductLayer(Brick* brick, int k, const LayerStep& step);
/// What comes into layer 0 through the lid in dt. Returns the sum over the columns [K].
double ApplyLid(Brick* brick, float dt_s);
/// theta of layer k with its sum and the maxima of its pairs of rows; boiling takes `latent_K` at `boil` [K].
void RefreshLayer(Brick* brick, int k, float boil, float latent_K);

/// Adds dt of damage to `count` cells of a row where theta >= kDamageStart; true when a cell of it is dead, Omega >= 1.
bool DamageRow(const float* theta, float* omega, int count, DamageRate rate, float dt_s);

}  // namespace fulcrum::thermal
