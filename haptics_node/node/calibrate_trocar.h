// Recording and result of `haptics_node calibrate-trocar`: poses of a tool that is moved about its trocar.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "haptics_node/device/pivot_fit.h"
#include "haptics_node/device/recorded_motion.h"
#include "services/base/config/cart.h"

namespace fulcrum::haptics {

struct TrocarMotion {
  std::vector<DevicePose> poses;  ///< Poses with a button pressed.
  std::string serial;             ///< Serial number of the device; empty for a simulated one.
};

/// Progress for the operator: `seconds` of motion recorded so far, and a problem of the device or an empty text.
using TrocarProgress = std::function<void(double seconds, const std::string& trouble)>;

/// Records poses of a tool's device while a button is held: the whole recording of a simulated device at once; a Touch
/// in real time until there are `seconds` of motion. Throws InputError if the cart has no moving device for the tool,
/// or a Touch delivers no motion for a minute.
[[nodiscard]] TrocarMotion RecordTrocarMotion(const config::CartConfig& cart, std::size_t tool, double seconds,
                                              const std::string& touch_library, const TrocarProgress& progress);

/// Result for the operator, in one line.
[[nodiscard]] std::string Describe(const PivotFit& fit);

}  // namespace fulcrum::haptics
