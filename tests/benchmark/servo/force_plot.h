// Force error of each strategy against the rate of physics and against the age of its reports, a panel per motion.
#pragma once

#include <string>
#include <vector>

namespace fulcrum::haptics {

struct ForceCurve {
  std::string label, colour;
  std::vector<double> x, error_pct;
};
struct ForcePanel {
  std::string title, x_label;
  std::vector<ForceCurve> curves;
};

/// First row: physics at 30 ... 1000 Hz, each report a period late. Second: 100 Hz, reports 1 ... 80 ms late. Third:
/// the same with stiffness reported 30 % high and viscosity 30 % low.
/// @param quick fewer points.
[[nodiscard]] std::vector<ForcePanel> MeasureForcePlot(bool quick);
/// Log-log, panels in rows of five with one legend.
[[nodiscard]] std::string ForceErrorSvg(const std::vector<ForcePanel>& panels);

}  // namespace fulcrum::haptics
