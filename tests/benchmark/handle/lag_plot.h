// The plot of jaw estimators: error against lag, one panel for motion and one for holds.
#pragma once

#include <string>
#include <vector>

namespace fulcrum::handle_bridge {

struct LagPoint {
  std::string family;  ///< Points of a family share a colour and are joined in the order given.
  std::string label;
  double lag_ms = 0;
  double motion_rms_deg = 0;
  double static_rms_deg = 0;
};

/// The lag's axis is a square root, because most lags of interest are below 2 ms; the targets are shaded.
[[nodiscard]] std::string LagSvg(const std::vector<LagPoint>& points);

}  // namespace fulcrum::handle_bridge
