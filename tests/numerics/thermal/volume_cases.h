// Cases of the tissue beneath the sheet with an analytic solution: shared by tests and benchmark.
#pragma once

#include "thermal_node/volume/sheet_contact.h"

namespace fulcrum::thermal {

/// Fat without perfusion: only conduction.
[[nodiscard]] ThermalParams PlainFat(float cell_m);
/// Flat sheet above bricks_x x bricks_y whole bricks.
[[nodiscard]] Sheet SheetOfBricks(int bricks_x, int bricks_y, float cell_m);

/// Largest error of a half-space whose surface is held at 40 K from t = 0 on, after 8 s, against erfc, relative to
/// 40 K. `pitch_m` is the edge of a cell; the step is proportional to its square.
[[nodiscard]] double HalfSpaceError(float pitch_m);

/// Largest error of a product of cosines over two bricks after its time constant, relative to its amplitude at the
/// start. Half waves in depth and across a brick; the step is in proportion to the square of the cells per wave.
[[nodiscard]] double CosineError(int half_waves);

/// Largest error of the temperature of a sheet that conducts well and lies on fat, from 40 K on, at 1 to 4 s against
/// exp(b^2 t) erfc(b sqrt(t)), b = sqrt(k rc of fat) / (rc d of the sheet); relative to 40 K. A stirred layer in
/// contact with a half-space (Carslaw and Jaeger, Conduction of Heat in Solids, 12.4).
[[nodiscard]] double SheetOnFatError(float cell_m);

/// A block of 64 x 64 x 32 cells at 150 um, all rows and layers awake, under a warm sheet, with current.
struct VolumeTimes {
  double step_ms = 0;     ///< Heat and damage, a hot spot: damage in a part of the cells.
  double all_hot_ms = 0;  ///< Every cell warm enough for damage.
  double contact_ms = 0;  ///< The same as step_ms with the exchange with 96 x 96 cells of the sheet.
};
[[nodiscard]] VolumeTimes TimeVolume();

}  // namespace fulcrum::thermal
