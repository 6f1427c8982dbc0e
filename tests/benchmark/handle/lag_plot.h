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

/// @param max_lag_ms, max_rms_deg what lies beyond is not drawn.
[[nodiscard]] std::string LagSvg(const std::vector<LagPoint>& points, double max_lag_ms, double max_rms_deg);

}  // namespace fulcrum::handle_bridge
