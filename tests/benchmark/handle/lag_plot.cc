#include "tests/benchmark/handle/lag_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace fulcrum::handle_bridge {
namespace {

// Panel geometry [px].
constexpr double kWidth = 640, kHeight = 540, kLeft = 62, kRight = 20, kTop = 66, kBottom = 50;
constexpr double kLabelHeight = 12, kLabelWidth = 84;
// Points beyond these limits are not drawn.
constexpr double kMinLag_ms = -0.5, kMaxLag_ms = 24;
constexpr std::array kMaxRms_deg = {1.1, 0.7};
constexpr double kTargetLag_ms = 2;
constexpr std::array kTargetRms_deg = {0.36, 0.25};
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

double Error(const LagPoint& point, std::size_t panel) {
  return panel == 0 ? point.motion_rms_deg : point.static_rms_deg;
}

struct Panel {
  std::size_t index;
  [[nodiscard]] double left() const { return kWidth * static_cast<double>(index); }
  [[nodiscard]] double X(double lag_ms) const {
    const double share = std::sqrt((lag_ms - kMinLag_ms) / (kMaxLag_ms - kMinLag_ms));
    return left() + kLeft + (kWidth - kLeft - kRight) * share;
  }
  [[nodiscard]] double Y(double rms_deg) const {
    return kHeight - kBottom - (kHeight - kTop - kBottom) * rms_deg / kMaxRms_deg[index];
  }
  [[nodiscard]] bool Shows(const LagPoint& point) const {
    return point.lag_ms >= kMinLag_ms && point.lag_ms <= kMaxLag_ms && Error(point, index) <= kMaxRms_deg[index];
  }
};

std::string Axes(const Panel& panel) {
  const double target_y = panel.Y(kTargetRms_deg[panel.index]);
  std::string svg = Format("<rect x='%.1f' y='%.1f' width='%.1f' height='%.1f' fill='#e3f2e1'/>\n", panel.X(kMinLag_ms),
                           target_y, panel.X(kTargetLag_ms) - panel.X(kMinLag_ms), panel.Y(0) - target_y);
  svg += Text(panel.left() + kWidth / 2, 50, "middle", 13, "#111",
              panel.index == 0 ? "within moves of 5 to 50 deg" : "holding still, tremor 0.25 deg");
  for (const double lag : {0.0, 1.0, 2.0, 5.0, 10.0, 20.0}) {
    svg += Line(panel.X(lag), panel.Y(0), panel.X(lag), kTop, "#d8d8d8");
    svg += Text(panel.X(lag), panel.Y(0) + 16, "middle", 11, "#444", Format("%.0f", lag));
  }
  for (int tenth = 0; 0.1 * tenth <= kMaxRms_deg[panel.index]; ++tenth) {
    const double y = panel.Y(0.1 * tenth);
    svg += Line(panel.X(kMinLag_ms), y, panel.X(kMaxLag_ms), y, tenth == 0 ? "#777" : "#d8d8d8");
    svg += Text(panel.X(kMinLag_ms) - 6, y + 4, "end", 11, "#444", Format("%.1f", 0.1 * tenth));
  }
  svg += Text(panel.left() + kWidth / 2, kHeight - 12, "middle", 12, "#111", "lag [ms]");
  svg += Format("<g transform='translate(%.1f %.1f) rotate(-90)'>", panel.left() + 16, kHeight / 2) +
         Text(0, 0, "middle", 12, "#111", "RMS error [deg]") + "</g>\n";
  return svg;
}

/// Labels of one panel, each beside its point where there is room.
class Labels {
 public:
  std::string Place(double x, double y, double right, const char* colour, const std::string& text) {
    const bool flip = x + kLabelWidth > right;
    const double from = flip ? x - 7 - kLabelWidth : x + 7;
    double at = y;
    for (int turn = 1; Taken(from, at); ++turn) {
      at = y + (turn % 2 == 0 ? 0.5 : -0.5) * kLabelHeight * ((turn + 1) / 2);
    }
    taken_.emplace_back(from, at);
    std::string svg = Text(flip ? x - 7 : x + 7, at + 4, flip ? "end" : "start", 11, colour, text);
    if (std::abs(at - y) > kLabelHeight) {
      svg += Line(x, y, flip ? x - 7 : x + 7, at, "#bbb");
    }
    return svg;
  }

 private:
  [[nodiscard]] bool Taken(double x, double y) const {
    return std::any_of(taken_.begin(), taken_.end(), [&](const auto& t) {
      return std::abs(t.first - x) < kLabelWidth && std::abs(t.second - y) < kLabelHeight;
    });
  }
  std::vector<std::pair<double, double>> taken_;
};

}  // namespace

std::string LagSvg(const std::vector<LagPoint>& points) {
  std::string svg =
      Format(
          "<svg xmlns='http://www.w3.org/2000/svg' width='%.0f' height='%.0f' viewBox='0 0 %.0f %.0f' "
          "font-family='sans-serif'>\n",
          2 * kWidth, kHeight, 2 * kWidth, kHeight) +
      "<rect width='100%' height='100%' fill='white'/>\n" +
      Text(kWidth, 24, "middle", 16, "#111", "Jaw angle from counts of 1.72 deg: error against lag (shaded: target)");
  for (const Panel panel : {Panel{0}, Panel{1}}) {
    svg += Axes(panel);
    Labels labels;
    std::vector<std::string> families;
    const LagPoint* before = nullptr;
    for (const LagPoint& point : points) {
      if (std::find(families.begin(), families.end(), point.family) == families.end()) {
        families.push_back(point.family);
        before = nullptr;
      }
      if (!panel.Shows(point)) {
        before = nullptr;
        continue;
      }
      const char* colour = kColours[(families.size() - 1) % kColours.size()];
      const double x = panel.X(point.lag_ms), y = panel.Y(Error(point, panel.index));
      if (before) {
        svg += Line(panel.X(before->lag_ms), panel.Y(Error(*before, panel.index)), x, y, colour);
      }
      before = &point;
      svg += Format("<circle cx='%.1f' cy='%.1f' r='4' fill='%s'/>\n", x, y, colour);
      svg += labels.Place(x, y, panel.X(kMaxLag_ms), colour, point.label);
    }
  }
  return svg + "</svg>\n";
}

}  // namespace fulcrum::handle_bridge
