// Current of an electrode into an infinite leaky sheet, by methods independent of the solver.
#pragma once

#include "services/base/core/types.h"
#include "thermal_node/heat/material.h"

namespace fulcrum::thermal {

/// A capsule that lies on the sheet and its sparks, as defined in coupling/electrode.h [m].
struct CapsuleOnSheet {
  double length_m = 0;  ///< Length of its axis; 0: a disc.
  double radius_m = 5e-4;
  double arc_m = 4e-4;
};

/// Current at 1 V [S] on the whole plane: finite volumes in double on a quarter of it, with cells of `core_m` where
/// metal and sparks are and ever wider ones out to eight decay lengths of the potential, solved directly.
[[nodiscard]] double ReferenceConductance(const Material& material, const CapsuleOnSheet& capsule, double core_m);

/// The same for a disc without sparks, exactly: I0 under the metal, K0 beside it.
[[nodiscard]] double DiscConductance(const Material& material, double radius_m);

/// Current that the source window draws from wet tissue at 1 V [S].
/// @param heading direction of the capsule's axis [rad].
/// @param from_node offset of the capsule's middle from a corner of cells in the middle of the sheet [cells].
[[nodiscard]] double WindowConductance(const Material& material, const CapsuleOnSheet& capsule, float heading,
                                       const Vec2f& from_node);

/// A disc on the sheet over fat of depth H over a conductor, in three dimensions: finite volumes in r and z, in double,
/// cells of `rim_m` at the disc's rim and ever wider ones away from it. 4 um are within 0.3 % of 8 um.
struct DiscInDepth {
  double conductance_S = 0;
  double sheet_share = 0;  ///< Of the power.
};
[[nodiscard]] DiscInDepth SolveDiscInDepth(const Material& material, double radius_m, double rim_m);

/// Where the generator's energy goes, as shares of it: a disc on wet tissue.
struct EnergyShares {
  double sheet = 0;        ///< In and beyond the window.
  double beyond = 0;       ///< The part of `sheet` beyond the window.
  double beneath = 0;      ///< The tissue beneath.
  double unaccounted = 0;  ///< Neither these nor the film.
};
[[nodiscard]] EnergyShares SharesOfEnergy(const Material& material, bool tented = false);

}  // namespace fulcrum::thermal
