// Line plots over session time or over integers as inline SVG.
#pragma once

#include <string>
#include <vector>

#include "services/session/supervisor/session_record.h"

namespace fulcrum::supervisor {

struct PlotLine {
  std::string label;
  std::string colour;  ///< CSS colour.
  const Curve* curve;
};

struct PlotSettings {
  std::string title;
  std::string unit;
  double end_s = 0;             ///< Right end of the time axis [s].
  std::vector<double> marks_s;  ///< Restarts: dashed vertical lines.
  std::string x_label = "session time [s]";
  bool dots = false;  ///< Draws a dot at each point, for plots over integers.
};

/// The plot as an <svg> element; empty when no line has a point.
[[nodiscard]] std::string SvgPlot(const PlotSettings& settings, const std::vector<PlotLine>& lines);

/// Step of 1, 2 or 5 times a power of ten that divides `span` > 0 into at most `most` parts.
[[nodiscard]] double NiceStep(double span, int most);

}  // namespace fulcrum::supervisor
