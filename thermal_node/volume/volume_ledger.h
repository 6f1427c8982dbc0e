// Energy balance of the volume, as Ledger is that of the sheet.
#pragma once

#include <algorithm>
#include <cmath>

namespace fulcrum::thermal {

/// All in joule since the start.
struct VolumeLedger {
  double joule = 0;        ///< Deposited by the leak current.
  double from_sheet = 0;   ///< Conducted from the sheet; part of `lost` in the sheet's ledger.
  double perfused = 0;     ///< Carried away by blood.
  double dropped = 0;      ///< Discarded when a brick fell asleep.
  double quarantined = 0;  ///< Removed with quarantined cells.

  /// |in - out - stored| relative to the input.
  [[nodiscard]] double ClosureError(double stored) const {
    const double in = joule + from_sheet;
    return std::abs(in - perfused - dropped - quarantined - stored) /
           std::max(std::abs(joule) + std::abs(from_sheet), 1e-12);
  }
};

}  // namespace fulcrum::thermal
