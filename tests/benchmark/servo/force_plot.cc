#include "tests/benchmark/servo/force_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "tests/benchmark/servo/motions.h"
#include "tests/benchmark/servo/strategies.h"

namespace fulcrum::haptics {
namespace {

// Geometry [px].
constexpr double kPanelWidth = 330, kPanelHeight = 330, kLeft = 52, kRight = 14, kTop = 34, kBottom = 44;
constexpr double kHead = 78;
constexpr int kColumns = 5;
// Limits of the error axis, equal in all panels [%].
constexpr double kLowest = 0.003, kHighest = 300;

/// A logarithmic axis.
struct Axis {
  double low, high, from, to;
  [[nodiscard]] double At(double value) const {
    return from + (to - from) * std::log(std::clamp(value, low, high) / low) / std::log(high / low);
  }
};

[[gnu::format(printf, 2, 3)]] void Append(std::string* out, const char* format, ...) {
  char line[512];
  va_list args;
  va_start(args, format);
  std::vsnprintf(line, sizeof(line), format, args);
  va_end(args);
  *out += line;
}

void DrawGrid(const Axis& x, const Axis& y, const std::vector<double>& ticks, std::string* out) {
  for (const double v : ticks) {
    Append(out, "<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f' stroke='#e4e4e4'/>\n", x.At(v), y.from, x.At(v), y.to);
    Append(out, "<text x='%.1f' y='%.1f' text-anchor='middle' font-size='10' fill='#444'>%g</text>\n", x.At(v),
           y.from + 14, v);
  }
  for (double v = 0.01; v <= kHighest; v *= 10) {
    Append(out, "<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f' stroke='#d4d4d4'/>\n", x.from, y.At(v), x.to, y.At(v));
    Append(out, "<text x='%.1f' y='%.1f' text-anchor='end' font-size='10' fill='#444'>%g</text>\n", x.from - 5,
           y.At(v) + 4, v);
  }
}

void DrawPanel(const ForcePanel& panel, double left, double top, std::string* out) {
  const std::vector<double>& ticks = panel.curves.front().x;
  const auto [low, high] = std::minmax_element(ticks.begin(), ticks.end());
  const Axis x{*low, *high, left + kLeft, left + kPanelWidth - kRight};
  const Axis y{kLowest, kHighest, top + kPanelHeight - kBottom, top + kTop};
  DrawGrid(x, y, ticks, out);
  Append(out, "<text x='%.1f' y='%.1f' text-anchor='middle' font-size='13' fill='#111'>%s</text>\n",
         (x.from + x.to) / 2, y.to - 8, panel.title.c_str());
  Append(out, "<text x='%.1f' y='%.1f' text-anchor='middle' font-size='11' fill='#111'>%s</text>\n",
         (x.from + x.to) / 2, y.from + 32, panel.x_label.c_str());
  for (const ForceCurve& curve : panel.curves) {
    Append(out, "<polyline fill='none' stroke-width='1.6' stroke='%s' points='", curve.colour.c_str());
    for (std::size_t i = 0; i < curve.x.size(); ++i)
      Append(out, "%.1f,%.1f ", x.At(curve.x[i]), y.At(curve.error_pct[i]));
    *out += "'/>\n";
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      Append(out, "<circle cx='%.1f' cy='%.1f' r='2.6' fill='%s'/>\n", x.At(curve.x[i]), y.At(curve.error_pct[i]),
             curve.colour.c_str());
    }
  }
}

ForcePanel MeasurePanel(const Motion& motion, const std::string& title, const std::string& x_label,
                        const std::vector<double>& values, Physics (*physics_at)(double)) {
  ForcePanel panel{title, x_label, {}};
  for (const NamedStrategy& strategy : Strategies()) {
    ForceCurve curve{strategy.name, strategy.colour, values, {}};
    for (const double value : values) {
      curve.error_pct.push_back(Follow(motion, physics_at(value), strategy.make().get()).percent);
    }
    panel.curves.push_back(curve);
  }
  return panel;
}

}  // namespace

std::vector<ForcePanel> MeasureForcePlot(bool quick) {
  const std::vector<double> rates =
      quick ? std::vector<double>{30, 100, 1000} : std::vector<double>{30, 50, 100, 200, 500, 1000};
  const std::vector<double> lates =
      quick ? std::vector<double>{1, 10, 80} : std::vector<double>{1, 2, 5, 10, 20, 40, 80};
  std::vector<ForcePanel> panels;
  for (const Motion& motion : Motions()) {
    panels.push_back(MeasurePanel(motion, motion.name, "physics [Hz], a period late", rates, [](double rate) {
      const double period = 1e-3 * std::round(1e3 / rate);  // Whole ticks.
      return Physics{period, period, {}, 0};
    }));
  }
  for (const Motion& motion : Motions()) {
    panels.push_back(MeasurePanel(motion, motion.name, "physics at 100 Hz, late by [ms]", lates, [](double late) {
      return Physics{0.010, 1e-3 * late, {}, 0};
    }));
  }
  for (const Motion& motion : Motions()) {
    panels.push_back(MeasurePanel(motion, std::string(motion.name) + ", K + 30 %, B - 30 %",
                                  "physics at 100 Hz, late by [ms]", lates, [](double late) {
                                    return Physics{0.010, 1e-3 * late, {1.3, 0.7}, 0};
                                  }));
  }
  return panels;
}

std::string ForceErrorSvg(const std::vector<ForcePanel>& panels) {
  const auto rows = static_cast<int>((panels.size() + kColumns - 1) / kColumns);
  const double width = kColumns * kPanelWidth, height = kHead + rows * kPanelHeight;
  std::string out;
  Append(&out,
         "<svg xmlns='http://www.w3.org/2000/svg' width='%.0f' height='%.0f' viewBox='0 0 %.0f %.0f' "
         "font-family='sans-serif'>\n",
         width, height, width, height);
  out += "<rect width='100%' height='100%' fill='white'/>\n";
  Append(&out, "<text x='%.0f' y='26' text-anchor='middle' font-size='16' fill='#111'>%s</text>\n", width / 2,
         "Force error [% of the RMS force], 1 kHz servo. Lower row: physics is wrong about stiffness and viscosity");
  double at = kLeft;
  for (const ForceCurve& curve : panels.front().curves) {
    Append(&out, "<line x1='%.0f' y1='52' x2='%.0f' y2='52' stroke='%s' stroke-width='3'/>\n", at, at + 24,
           curve.colour.c_str());
    Append(&out, "<text x='%.0f' y='56' font-size='12' fill='#111'>%s</text>\n", at + 30, curve.label.c_str());
    at += 270;
  }
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const std::size_t row = i / kColumns, column = i % kColumns;
    DrawPanel(panels[i], static_cast<double>(column) * kPanelWidth, kHead + static_cast<double>(row) * kPanelHeight,
              &out);
  }
  out += "</svg>\n";
  return out;
}

}  // namespace fulcrum::haptics
