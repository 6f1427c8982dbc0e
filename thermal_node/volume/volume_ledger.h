// Where the energy of the volume came from and went, as Ledger does for the sheet.
#pragma once

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {

/// All in joule since the start.
struct VolumeLedger {
  double joule = 0;        ///< Deposited by the leak current.
  double from_sheet = 0;   ///< Conducted from the sheet; what the sheet's ledger counts among its losses.
  double perfused = 0;     ///< Carried away by blood.
  double dropped = 0;      ///< Given up when a brick fell asleep.
  double quarantined = 0;  ///< Taken out with cells that went bad.

  /// |in - out - stored| relative to all that came in.
  [[nodiscard]] double ClosureError(double stored) const {
    const double in = joule + from_sheet;
    return std::abs(in - perfused - dropped - quarantined - stored) /
           std::max(std::abs(joule) + std::abs(from_sheet), 1e-12);
  }
};

}  // namespace fulcrum::thermal
