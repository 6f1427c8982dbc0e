// Measurements on tissue that others have published, with the product's parameters and none fitted. What a publication
// leaves open is assumed here, and stated.
#pragma once

#include "tests/numerics/thermal/flat_scene.h"

namespace fulcrum::thermal {

/// Druzijanic et al., Can. J. Surg. 55 (2012): peritoneum of 100 patients divided with monopolar diathermy; width of
/// dead tissue beside the cut in histology. Power and speed are not stated: a stroke at 35 W and 4 mm/s in mode cut.
/// @return cells with Omega >= 1 beside the slit, mean of both sides [m]
[[nodiscard]] double LateralDamage(float cell_m);

/// Hefermehl et al., BJU Int. 114 (2014): distance from a monopolar instrument up to which bovine musculofascial tissue
/// reaches 45 degrees, 60 W for 1 s. Mode and instrument's size: coag, 0.5 mm; tissue at body temperature, on fat.
/// @return largest distance from the metal [m]
[[nodiscard]] double SpreadOf45Degrees(float cell_m);

/// Matsuura et al., Eur. J. Gynaecol. Oncol. 42 (2021): time after an incision of porcine tissue at 40 W until the
/// hottest tissue has cooled to 60 degrees: within 1 s in mode cut, about 2 s in coag. Stroke of 12 mm at 4 mm/s.
/// @return [s]
[[nodiscard]] double CoolingTo60Degrees(CauteryMode mode, float cell_m);

/// Karaki et al., Comput. Methods Biomech. Biomed. Eng. 23 (2020): a blade moved through porcine liver in pure cut does
/// nothing visible at 10 W, coagulates without cutting at 25 W, and does both at 50 W. Liver after Gabriel et al. 1996
/// and Hasgall et al. (IT'IS); assumed: a blade of 2.5 x 0.5 mm along its way, 3 mm deep, at 5 mm/s. The sheet is the
/// liver over the depth of the blade.
struct Effect {
  double coagulated_mm2 = 0;  ///< Omega of collagen >= 1: visibly pale.
  double removed_mm2 = 0;
};
[[nodiscard]] Effect BladeOnLiver(float power_W, float cell_m);

}  // namespace fulcrum::thermal
