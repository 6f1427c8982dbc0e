#include "services/session/supervisor/svg_plot.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/escape.h"
#include "services/session/supervisor/outcome.h"

namespace fulcrum::supervisor {
namespace {

// Size and margins of a plot in SVG units; the margins have room for the labels of the axes.
constexpr double kWidth = 640, kHeight = 330;
constexpr double kLeft = 66, kRight = 18, kTop = 48, kBottom = 56;
constexpr double kTitleY = 24, kTitleX = kLeft - 50;
constexpr double kGlyph = 10.5, kTitleGlyph = 11.5, kLegendGap = 14, kLegendRow = 24;
constexpr std::size_t kMostDrawn = 1200;  // More points than pixels would only enlarge the file.

struct Axis {
  double step, end;
  int decimals;
};

Axis MakeAxis(double largest, int most) {
  const double span = largest > 0 ? largest : 1.0;
  const double step = NiceStep(span, most);
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  return {step, step * std::ceil(span / step - 1e-9), decimals};
}

std::string Text(double x, double y, const char* anchor, const std::string& text, const char* style = "") {
  return "<text x='" + Fixed(x, 1) + "' y='" + Fixed(y, 1) + "' text-anchor='" + anchor + "' " + style + ">" +
         EscapeHtml(text) + "</text>\n";
}

/// Place where a line's label begins.
struct Place {
  double x, y;
};

double WidthOf(const std::string& label) { return kGlyph * static_cast<double>(label.size()); }

/// Places of the labels of lines with points: right of the title while there is room, else in rows under it.
std::vector<Place> LegendOf(const std::vector<PlotLine>& lines, const std::string& title) {
  double width = 0;
  for (const PlotLine& line : lines) width += line.curve->points().empty() ? 0 : WidthOf(line.label) + kLegendGap;
  const double title_end = kTitleX + kTitleGlyph * static_cast<double>(title.size());
  const bool beside = title_end + width <= kWidth - kRight;
  Place next{beside ? kWidth - kRight - width + kLegendGap : kTitleX, beside ? kTitleY : kTitleY + kLegendRow};
  std::vector<Place> places;
  for (const PlotLine& line : lines) {
    const double step = line.curve->points().empty() ? 0 : WidthOf(line.label);
    if (next.x + step > kWidth - kRight + 1e-9) next = {kTitleX, next.y + kLegendRow};
    places.push_back(next);
    next.x += step > 0 ? step + kLegendGap : 0;
  }
  return places;
}

}  // namespace

double NiceStep(double span, int most) {
  const double raw = span / most;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power * (1 + 1e-9)) {
      return factor * power;
    }
  }
  return 10 * power;
}

std::string SvgPlot(const PlotSettings& settings, const std::vector<PlotLine>& lines) {
  double largest = 0;
  bool any = false;
  for (const PlotLine& line : lines) {
    any |= !line.curve->points().empty();
    largest = std::max(largest, line.curve->max());
  }
  if (!any) {
    return {};
  }
  const Axis value = MakeAxis(largest, 5);
  const double end_s = settings.end_s > 0 ? settings.end_s : 1.0;
  const double time_step = std::max(NiceStep(end_s, 8), settings.dots ? 1.0 : 0.0);
  const auto x_of = [&](double t) { return kLeft + (kWidth - kLeft - kRight) * std::clamp(t / end_s, 0.0, 1.0); };
  const std::string title = settings.title + " [" + settings.unit + "]";
  const std::vector<Place> legend = lines.size() > 1 ? LegendOf(lines, title) : std::vector<Place>{};
  // Rows of the legend enlarge the picture and leave the height of the plot as it is.
  const double top = kTop + (legend.empty() ? 0 : legend.back().y - kTitleY);
  const double height = kHeight + top - kTop;
  const auto y_of = [&](double v) {
    return height - kBottom - (kHeight - kTop - kBottom) * std::clamp(v / value.end, 0.0, 1.0);
  };

  std::string svg = "<svg viewBox='0 0 " + Fixed(kWidth, 0) + " " + Fixed(height, 0) + "' role='img' aria-label='" +
                    EscapeHtml(settings.title) + "'>\n";
  svg += Text(kTitleX, kTitleY, "start", title, "class='title'");
  for (double v = 0; v <= value.end * (1 + 1e-9); v += value.step) {
    svg += "<line class='grid' x1='" + Fixed(kLeft, 1) + "' x2='" + Fixed(kWidth - kRight, 1) + "' y1='" +
           Fixed(y_of(v), 1) + "' y2='" + Fixed(y_of(v), 1) + "'/>\n";
    svg += Text(kLeft - 8, y_of(v) + 6, "end", Fixed(v, value.decimals));
  }
  const int time_decimals = time_step < 1 ? 1 : 0;
  for (double t = 0; t <= end_s * (1 + 1e-9); t += time_step) {
    svg += Text(x_of(t), height - kBottom + 23, "middle", Fixed(t, time_decimals));
  }
  svg += Text(kWidth - kRight, height - 6, "end", settings.x_label);
  for (const double mark : settings.marks_s) {
    svg += "<line class='mark' x1='" + Fixed(x_of(mark), 1) + "' x2='" + Fixed(x_of(mark), 1) + "' y1='" +
           Fixed(top - 6, 1) + "' y2='" + Fixed(height - kBottom, 1) + "'><title>restart</title></line>\n";
  }
  for (std::size_t n = lines.size(); n-- > 0;) {
    const PlotLine& line = lines[n];
    const auto& points = line.curve->points();
    if (points.empty()) {
      continue;
    }
    svg += "<polyline fill='none' stroke='" + line.colour + "' stroke-width='2' points='";
    const std::size_t stride = points.size() / kMostDrawn + 1;
    for (std::size_t i = 0; i < points.size(); i += stride) {
      svg += Fixed(x_of(points[i].time_s), 1) + "," + Fixed(y_of(points[i].value), 1) + " ";
    }
    svg += "'/>\n";
    for (std::size_t i = 0; settings.dots && i < points.size(); i += stride) {
      svg += "<circle r='5' fill='" + line.colour + "' cx='" + Fixed(x_of(points[i].time_s), 1) + "' cy='" +
             Fixed(y_of(points[i].value), 1) + "'/>\n";
    }
    if (!legend.empty()) {
      svg += Text(legend[n].x, legend[n].y, "start", line.label,
                  ("fill='" + line.colour + "' style='fill:" + line.colour + "'").c_str());
    }
  }
  return svg + "</svg>\n";
}

}  // namespace fulcrum::supervisor
