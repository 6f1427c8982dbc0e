// Where the energy went. Doubles: a run sums millions of small terms.
#pragma once

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {

/// All in joule since the start.
struct Ledger {
  double joule = 0;        ///< Deposited in the sheet by current.
  double vapour = 0;       ///< Left with steam: latent and sensible heat of the water.
  double removed = 0;      ///< Sensible heat left in cells when they were removed.
  double debris = 0;       ///< Taken out with crumbs that hung on nothing any more.
  double hook = 0;         ///< From the hook's metal into the sheet by conduction; negative: the other way.
  double film = 0;         ///< Of the discharges, what went into the metal and the plume; not in the sheet.
  double plume = 0;        ///< The part of `film` that left with the plume.
  double lost = 0;         ///< Through both faces and by perfusion.
  double dropped = 0;      ///< Given up when a tile fell asleep.
  double quarantined = 0;  ///< Taken out with cells that went bad.
  double generator = 0;    ///< Delivered by the generator: joule, film, and what heats the tissue beneath and beyond.

  [[nodiscard]] double Out() const { return vapour + removed + debris + lost + dropped + quarantined; }
  /// |in - out - stored| relative to the input, of the sheet.
  [[nodiscard]] double ClosureError(double stored) const {
    return std::abs(joule + hook - Out() - stored) / std::max(joule + std::abs(hook), 1e-12);
  }
};

}  // namespace fulcrum::thermal
