// Line plots over session time, or over whole numbers, as inline SVG.
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
  double end_s = 0;             ///< Right end of the time axis.
  std::vector<double> marks_s;  ///< Restarts: dashed vertical lines.
  std::string x_label = "session time [s]";
  bool dots = false;  ///< Over whole numbers: a dot at each point.
};

/// Empty when no line has a point.
[[nodiscard]] std::string SvgPlot(const PlotSettings& settings, const std::vector<PlotLine>& lines);

/// A step of 1, 2 or 5 times a power of ten that divides `span` into at most `most` parts. span > 0.
[[nodiscard]] double NiceStep(double span, int most);

}  // namespace fulcrum::supervisor
