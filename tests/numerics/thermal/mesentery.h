// A published measurement: the rise of temperature 1 mm from a monopolar hook on mesentery, 50.5 +- 8.0 K.
#pragma once

#include "tests/numerics/thermal/flat_scene.h"

namespace fulcrum::thermal {

/// A hook of 0.5 mm at 30 W on a sheet of the default tissue, 0.3 mm thick, with cooling afterwards.
struct MesenteryCase {
  CauteryMode mode = CauteryMode::kCoag;
  float speed_m_s = 0;  ///< Speed of a stroke of 12 mm; 0: held still …
  float dwell_s = 1;    ///< … for this time.
  bool tented = true;
  float cell_m = 1e-4f;
};

/// Largest rise of temperature 1 mm from the metal [K]: beside the middle of the stroke, or the mean of all sides.
[[nodiscard]] double RiseAtOneMillimetre(const MesenteryCase& c);

}  // namespace fulcrum::thermal
