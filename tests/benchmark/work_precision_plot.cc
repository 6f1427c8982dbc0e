#include "tests/benchmark/work_precision_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace fulcrum::benchmark {
namespace {

// Panel geometry [px].
constexpr double kWidth = 600, kHeight = 520, kLeft = 64, kRight = 24, kTop = 72, kBottom = 52;
constexpr double kLabelHeight = 13, kLegendLine = 17;
constexpr double kCharacter = 6.1;  ///< Mean width of one at 11 px.
constexpr std::array kColours{"#1b6ca8", "#c8501e", "#2e8540", "#7b4fa3", "#8a6d1a", "#555555", "#b3245b"};

bool Drawn(double value) { return std::isfinite(value) && value > 0; }

/// A logarithmic axis from `low` to `high` onto pixels.
struct Axis {
  double low, high, from, to;
  [[nodiscard]] double At(double value) const {
    return from + (to - from) * std::log(value / low) / std::log(high / low);
  }
};

/// Whole halves of decades (1, 3, 10, ...) around the values.
Axis AxisOver(const std::vector<double>& values, double from, double to) {
  double low = 1e300, high = 0;
  for (const double v : values) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  const auto half = [](double v, bool up) {
    const double at = 2 * std::log10(v), whole = up ? std::ceil(at + 0.05) : std::floor(at - 0.05);
    return std::pow(10.0, whole / 2);
  };
  return {half(low, false), half(high, true), from, to};
}

class Svg {
 public:
  void Line(double x0, double y0, double x1, double y1, const char* colour, double width) {
    Print("<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f' stroke='%s' stroke-width='%.1f'/>\n", x0, y0, x1, y1, colour,
          width);
  }
  void Circle(double x, double y, const char* colour) {
    Print("<circle cx='%.1f' cy='%.1f' r='4' fill='%s'/>\n", x, y, colour);
  }
  void Text(double x, double y, const char* anchor, double size, const char* colour, const std::string& text) {
    Print("<text x='%.1f' y='%.1f' text-anchor='%s' font-size='%.0f' fill='%s'>%s</text>\n", x, y, anchor, size, colour,
          text.c_str());
  }
  void Raw(const std::string& text) { out_ += text; }
  [[nodiscard]] const std::string& text() const { return out_; }

 private:
  template <class... Args>
  void Print(const char* format, Args... args) {
    const int size = std::snprintf(nullptr, 0, format, args...);
    std::string line(static_cast<std::size_t>(size) + 1, '\0');
    std::snprintf(line.data(), line.size(), format, args...);
    line.pop_back();
    out_ += line;
  }
  std::string out_;
};

/// Characters of a UTF-8 text.
double Length(const std::string& text) {
  const auto begins = [](char c) { return (static_cast<unsigned char>(c) & 0xc0u) != 0x80u; };
  return static_cast<double>(std::count_if(text.begin(), text.end(), begins));
}

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", value);
  return text;
}

void DrawAxes(const Axis& x, const Axis& y, Svg* svg) {
  for (double decade = std::pow(10.0, std::floor(std::log10(x.low))); decade <= x.high; decade *= 10) {
    for (const double part : {1.0, 2.0, 5.0}) {
      const double v = part * decade;
      if (v >= x.low && v <= x.high) {
        svg->Line(x.At(v), y.from, x.At(v), y.to, part == 1 ? "#c8c8c8" : "#ececec", 1);
        svg->Text(x.At(v), y.from + 16, "middle", 11, "#444", Number(v));
      }
    }
  }
  for (double decade = std::pow(10.0, std::floor(std::log10(y.low))); decade <= y.high; decade *= 10) {
    for (const double part : {1.0, 2.0, 5.0}) {
      const double v = part * decade;
      if (v >= y.low && v <= y.high) {
        svg->Line(x.from, y.At(v), x.to, y.At(v), part == 1 ? "#c8c8c8" : "#ececec", 1);
        svg->Text(x.from - 6, y.At(v) + 4, "end", 11, "#444", Number(v));
      }
    }
  }
  svg->Line(x.from, y.from, x.to, y.from, "#444", 1);
  svg->Line(x.from, y.from, x.from, y.to, "#444", 1);
}

/// Boxes that labels must not cover.
struct Box {
  double x0, y0, x1, y1;
  [[nodiscard]] bool Meets(const Box& o) const { return x0 < o.x1 && o.x0 < x1 && y0 < o.y1 && o.y0 < y1; }
};

/// Writes a label beside its point: right, left, above or below, farther away until the place is free.
void DrawLabel(double px, double py, const std::string& label, const char* colour, const Axis& x,
               std::vector<Box>* taken, Svg* svg) {
  const double width = kCharacter * Length(label);
  for (double away = 0; away < 200; away += kLabelHeight / 2) {
    for (const auto& [dx, dy] : {std::pair{7.0, -away}, {7.0, away}, {-7.0 - width, -away}, {-7.0 - width, away}}) {
      const Box box{px + dx, py + dy - 9, px + dx + width, py + dy + 4};
      const bool inside = box.x0 > x.from && box.x1 < x.to + kRight;
      if (inside && std::none_of(taken->begin(), taken->end(), [&](const Box& b) { return b.Meets(box); })) {
        taken->push_back(box);
        if (away > kLabelHeight) {
          svg->Line(px, py, dx > 0 ? box.x0 : box.x1, py + dy - 3, "#aaa", 0.7);
        }
        svg->Text(box.x0, py + dy + 1, "start", 11, colour, label);
        return;
      }
    }
  }
}

/// Names of the families below the panels, one a line.
void DrawLegend(const std::vector<std::string>& families, Svg* svg) {
  for (std::size_t f = 0; f < families.size(); ++f) {
    const char* colour = kColours[f % kColours.size()];
    const double y = kHeight + kLegendLine * static_cast<double>(f) + 8;
    svg->Circle(kLeft + 4, y - 4, colour);
    svg->Text(kLeft + 14, y, "start", 12, colour, families[f]);
  }
}

}  // namespace

std::string WorkPrecisionSvg(const std::string& heading, const std::vector<std::string>& titles,
                             std::vector<WorkPrecisionPoint> points, bool legend) {
  std::stable_sort(points.begin(), points.end(),
                   [](const WorkPrecisionPoint& a, const WorkPrecisionPoint& b) { return a.time_ms < b.time_ms; });
  std::vector<std::string> families;
  std::vector<double> times;
  for (const WorkPrecisionPoint& p : points) {
    if (std::find(families.begin(), families.end(), p.family) == families.end()) {
      families.push_back(p.family);
    }
    if (Drawn(p.time_ms)) {
      times.push_back(p.time_ms);
    }
  }
  Svg svg;
  const double height = kHeight + (legend ? kLegendLine * static_cast<double>(families.size()) + 4 : 0);
  const double width = kWidth * static_cast<double>(titles.size());
  const auto pixels = [](double value) { return std::to_string(std::lround(value)); };
  svg.Raw("<svg xmlns='http://www.w3.org/2000/svg' width='" + pixels(width) + "' height='" + pixels(height) +
          "' viewBox='0 0 " + pixels(width) + " " + pixels(height) +
          "' font-family='sans-serif'>\n<rect width='100%' height='100%' fill='white'/>\n");
  svg.Text(width / 2, 24, "middle", 16, "#111", heading);
  for (std::size_t panel = 0; panel < titles.size(); ++panel) {
    const double left = kWidth * static_cast<double>(panel);
    std::vector<double> errors;
    for (const WorkPrecisionPoint& p : points) {
      if (Drawn(p.error_pct[panel]) && Drawn(p.time_ms)) {
        errors.push_back(p.error_pct[panel]);
      }
    }
    if (errors.empty()) {
      continue;
    }
    const Axis x = AxisOver(times, left + kLeft, left + kWidth - kRight);
    const Axis y = AxisOver(errors, kHeight - kBottom, kTop);
    DrawAxes(x, y, &svg);
    svg.Text((x.from + x.to) / 2, 52, "middle", 13, "#111", titles[panel]);
    svg.Text((x.from + x.to) / 2, kHeight - 14, "middle", 12, "#111", "time per frame of 10 ms [ms]");
    svg.Raw("<g transform='translate(" + Number(left + 16) + " " + Number((y.from + y.to) / 2) + ") rotate(-90)'>");
    svg.Text(0, 0, "middle", 12, "#111", "error [%]");
    svg.Raw("</g>\n");
    std::vector<Box> taken;
    for (const WorkPrecisionPoint& p : points) {
      if (Drawn(p.error_pct[panel]) && Drawn(p.time_ms)) {
        const double px = x.At(p.time_ms), py = y.At(p.error_pct[panel]);
        taken.push_back({px - 5, py - 5, px + 5, py + 5});
      }
    }
    for (std::size_t f = 0; f < families.size(); ++f) {
      const char* colour = kColours[f % kColours.size()];
      const WorkPrecisionPoint* before = nullptr;
      for (const WorkPrecisionPoint& p : points) {
        if (p.family != families[f] || !Drawn(p.error_pct[panel]) || !Drawn(p.time_ms)) {
          continue;
        }
        const double px = x.At(p.time_ms), py = y.At(p.error_pct[panel]);
        if (before != nullptr) {
          svg.Line(x.At(before->time_ms), y.At(before->error_pct[panel]), px, py, colour, 1.2);
        }
        svg.Circle(px, py, colour);
        before = &p;
      }
      for (const WorkPrecisionPoint& p : points) {
        if (p.family == families[f] && Drawn(p.error_pct[panel]) && Drawn(p.time_ms)) {
          DrawLabel(x.At(p.time_ms), y.At(p.error_pct[panel]), p.label, colour, x, &taken, &svg);
        }
      }
    }
  }
  if (legend) DrawLegend(families, &svg);
  svg.Raw("</svg>\n");
  return svg.text();
}

}  // namespace fulcrum::benchmark
