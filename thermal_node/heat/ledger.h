// Energy balance of the sheet, in double because a run sums millions of small terms.
#pragma once

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {

/// All in joule since the start.
struct Ledger {
  double joule = 0;        ///< Deposited in the sheet by current.
  double vapour = 0;       ///< Left with steam: latent and sensible heat of the water.
  double removed = 0;      ///< Sensible heat left in cells when they were removed.
  double debris = 0;       ///< Removed with crumbs.
  double hook = 0;         ///< Conducted from the hook's metal into the sheet; negative: from the sheet into the metal.
  double film = 0;         ///< Heat of the discharges that went into the metal and the plume, not into the sheet.
  double plume = 0;        ///< The part of `film` that left with the plume.
  double lost = 0;         ///< Lost through both faces and by perfusion.
  double dropped = 0;      ///< Discarded when a tile fell asleep.
  double quarantined = 0;  ///< Removed with quarantined cells.
  /// Delivered by the generator: joule, film, and the heat of the tissue beneath.
  double generator = 0;

  [[nodiscard]] double Out() const { return vapour + removed + debris + lost + dropped + quarantined; }
  /// |in - out - stored| of the sheet relative to its input.
  [[nodiscard]] double ClosureError(double stored) const {
    return std::abs(joule + hook - Out() - stored) / std::max(joule + std::abs(hook), 1e-12);
  }
};

}  // namespace fulcrum::thermal
