// Solids whose answers an independent solver has computed (calculix_references.py, deploy/validation/calculix.csv), by
// the reference solver on meshes as the organ has: the law and its discretisation, without the error of a solver in
// real time.
#pragma once

#include "tests/validation/validation.h"

namespace fulcrum::validation {

/// A block of 40 x 40 x 20 mm on a plate to which it sticks, pressed from above over a disc of 10 mm radius by
/// 14 kPa (1 - r^2/R^2)^2: depth of the dent. @param n elements over the height.
[[nodiscard]] Quantities Dent(int n);

/// A tube of radii 15 and 18 mm in plane strain, pressed from above and below by 350 Pa cos^2(3 angle), that is within
/// 30 degrees: change of the diameters. @param n layers of the wall, with 24 n segments; 1 as the organ of built-in.
[[nodiscard]] Quantities Pinch(int n);

/// A bar of 80 x 10 x 10 mm, clamped, with a pressure of 170 Pa (x/l)^2 from above: path of the end. @param n elements
/// over the thickness, even.
[[nodiscard]] Quantities Bend(int n);

/// Natural frequencies of the bar (bending, first and second) and of the tube (ovalling), with a density of 1000 kg/m^3
/// in lumped masses. @param n as for Bend and for Pinch.
[[nodiscard]] Quantities VibrateBar(int n);
[[nodiscard]] Quantities VibrateTube(int n);

}  // namespace fulcrum::validation
