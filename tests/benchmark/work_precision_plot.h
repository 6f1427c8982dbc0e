// The work-precision plot: error against run time, log-log, one point a solver, in one panel per kind of error.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::benchmark {

struct WorkPrecisionPoint {
  std::string label;
  std::string family;             ///< Points of a family share a colour and are joined in the order of time.
  double time_ms = 0;             ///< Per frame.
  std::vector<double> error_pct;  ///< One per panel; not positive or not finite: not drawn.
};

/// Panels stand side by side under `titles`. With a legend the families are named below; without one, only the labels
/// name them.
[[nodiscard]] std::string WorkPrecisionSvg(const std::string& heading, const std::vector<std::string>& titles,
                                           std::vector<WorkPrecisionPoint> points, bool legend = false);

}  // namespace fulcrum::benchmark
