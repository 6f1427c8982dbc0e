#include "tests/benchmark/handle/lag_plot.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace fulcrum::handle_bridge {
namespace {

// Panel geometry [px].
constexpr double kWidth = 620, kHeight = 500, kLeft = 62, kRight = 20, kTop = 66, kBottom = 50;
constexpr double kMinLag_ms = -1;
constexpr double kLineHeight = 12;
constexpr std::array kColours{"#555555", "#1b6ca8", "#8a6d1a", "#7b4fa3", "#2e8540", "#c8501e", "#b3245b"};

template <class... Args>
std::string Format(const char* format, Args... args) {
  char text[256];
  std::snprintf(text, sizeof(text), format, args...);
  return text;
}

std::string Text(double x, double y, const char* anchor, int size, const char* colour, const std::string& text) {
  return Format("<text x='%.1f' y='%.1f' text-anchor='%s' font-size='%d' fill='%s'>", x, y, anchor, size, colour) +
         text + "</text>\n";
}

std::string Line(double x0, double y0, double x1, double y1, const char* colour) {
  return Format("<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f' stroke='%s'/>\n", x0, y0, x1, y1, colour);
}

struct Panel {
  double left, max_lag_ms, max_rms_deg;
  [[nodiscard]] double X(double lag_ms) const {
    return left + kLeft + (kWidth - kLeft - kRight) * (lag_ms - kMinLag_ms) / (max_lag_ms - kMinLag_ms);
  }
  [[nodiscard]] double Y(double rms_deg) const {
    return kHeight - kBottom - (kHeight - kTop - kBottom) * rms_deg / max_rms_deg;
  }
};

std::string Axes(const Panel& panel, const char* title) {
  std::string svg = Text(panel.left + kWidth / 2, 50, "middle", 13, "#111", title);
  for (double lag = 0; lag <= panel.max_lag_ms; lag += 2) {
    svg += Line(panel.X(lag), panel.Y(0), panel.X(lag), kTop, lag == 0 ? "#999" : "#e4e4e4");
    svg += Text(panel.X(lag), panel.Y(0) + 16, "middle", 11, "#444", Format("%.0f", lag));
  }
  for (int tenth = 0; tenth <= static_cast<int>(10 * panel.max_rms_deg + 0.5); tenth += 2) {
    const double y = panel.Y(0.1 * tenth);
    svg += Line(panel.X(kMinLag_ms), y, panel.X(panel.max_lag_ms), y, tenth == 0 ? "#999" : "#e4e4e4");
    svg += Text(panel.X(kMinLag_ms) - 6, y + 4, "end", 11, "#444", Format("%.1f", 0.1 * tenth));
  }
  svg += Text(panel.left + kWidth / 2, kHeight - 12, "middle", 12, "#111", "lag [ms]");
  svg += Format("<g transform='translate(%.1f %.1f) rotate(-90)'>", panel.left + 16, panel.Y(0.5 * panel.max_rms_deg)) +
         Text(0, 0, "middle", 12, "#111", "RMS error [deg]") + "</g>\n";
  return svg;
}

}  // namespace

std::string LagSvg(const std::vector<LagPoint>& points, double max_lag_ms, double max_rms_deg) {
  std::string svg =
      Format("<svg xmlns='http://www.w3.org/2000/svg' width='%.0f' height='%.0f' font-family='sans-serif'>\n",
             2 * kWidth, kHeight) +
      "<rect width='100%' height='100%' fill='white'/>\n" +
      Text(kWidth, 24, "middle", 16, "#111", "Jaw angle from 1.72 deg counts: error against lag");
  for (int p = 0; p < 2; ++p) {
    const Panel panel{p * kWidth, max_lag_ms, max_rms_deg};
    svg += Axes(panel, p == 0 ? "within moves of 5 to 50 deg" : "holding still, tremor 0.25 deg");
    const LagPoint* before = nullptr;
    std::vector<std::string> families;
    std::vector<std::pair<double, double>> labels;
    for (const LagPoint& point : points) {
      if (std::find(families.begin(), families.end(), point.family) == families.end()) {
        families.push_back(point.family);
        before = nullptr;
      }
      const char* colour = kColours[(families.size() - 1) % kColours.size()];
      const double rms = p == 0 ? point.motion_rms_deg : point.static_rms_deg;
      if (rms > max_rms_deg || point.lag_ms > max_lag_ms) {
        before = nullptr;
        continue;
      }
      const double x = panel.X(point.lag_ms), y = panel.Y(rms);
      if (before) {
        svg += Line(panel.X(before->lag_ms), panel.Y(p == 0 ? before->motion_rms_deg : before->static_rms_deg), x, y,
                    colour);
      }
      before = &point;
      svg += Format("<circle cx='%.1f' cy='%.1f' r='4' fill='%s'/>\n", x, y, colour);
      // Labels of crowded points go down until there is room.
      double label_y = y + 4;
      const auto taken = [&](double at) {
        return std::any_of(labels.begin(), labels.end(), [&](const auto& l) {
          return std::abs(l.first - x) < 90 && std::abs(l.second - at) < kLineHeight;
        });
      };
      while (taken(label_y)) {
        label_y += 2;
      }
      labels.emplace_back(x, label_y);
      svg += Text(x + 7, label_y, "start", 11, colour, point.label);
    }
  }
  return svg + "</svg>\n";
}

}  // namespace fulcrum::handle_bridge
