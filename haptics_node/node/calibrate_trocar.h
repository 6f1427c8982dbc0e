// The work behind `haptics_node calibrate-trocar`: poses of a tool that is moved about its trocar, and the fit.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "haptics_node/device/pivot_fit.h"
#include "haptics_node/device/recorded_motion.h"
#include "services/base/config/cart.h"

namespace fulcrum::haptics {

struct TrocarMotion {
  std::vector<DevicePose> poses;  ///< Those with a button down.
  std::string serial;             ///< Of the device; empty for a simulated one.
};

/// What the operator is told meanwhile; `seconds` of motion are there so far.
using TrocarProgress = std::function<void(double seconds, const std::string& trouble)>;

/// Poses of the device of a tool while a button is held: a simulated device's whole recording at once; a Touch's in
/// real time until `seconds` of motion are there. Throws InputError when the cart gives that tool no device that
/// moves, and when a Touch gives no motion for a minute.
[[nodiscard]] TrocarMotion RecordTrocarMotion(const config::CartConfig& cart, std::size_t tool, double seconds,
                                              const std::string& touch_library, const TrocarProgress& progress);

/// Result for the operator, in one line.
[[nodiscard]] std::string Describe(const PivotFit& fit);

}  // namespace fulcrum::haptics
