#include "services/records/log_tools/cut_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "services/base/picture/canvas.h"

namespace fulcrum::log_tools {
namespace {

using picture::Canvas;
using picture::Mix;
using picture::Rgb;

constexpr Rgb kPaper{255, 255, 255}, kInk{25, 32, 40}, kSoft{120, 130, 140}, kHole{20, 20, 24}, kIsland{0, 230, 60},
    kMetal{30, 110, 255}, kIdleMetal{170, 190, 215}, kTouched{120, 190, 255}, kCurrent{255, 40, 160},
    kCentre{255, 225, 0}, kDamaged{120, 80, 60};

/// Colour of living tissue as a function of its highest temperature [C].
struct Heat {
  double temperature_C;
  Rgb colour;
  const char* label;
};
constexpr std::array kHeats{Heat{37, {243, 205, 198}, "37"}, Heat{60, {250, 235, 215}, "60"},
                            Heat{80, {245, 214, 150}, "80"}, Heat{100, {226, 140, 62}, "100"},
                            Heat{147, {128, 40, 20}, "147"}};

Rgb HeatColour(double temperature_C) {
  for (std::size_t i = 1; i < kHeats.size(); ++i) {
    if (temperature_C > kHeats[i].temperature_C) continue;
    const double f =
        (temperature_C - kHeats[i - 1].temperature_C) / (kHeats[i].temperature_C - kHeats[i - 1].temperature_C);
    return Mix(kHeats[i - 1].colour, kHeats[i].colour, std::max(0.0, f));
  }
  return kHeats.back().colour;
}

/// Pixels per texel: as many as fit, but at least the first of these.
constexpr int kLeastScale = 4, kMostScale = 10, kWanted = 1100;
constexpr int kLeft = 84, kTop = 44, kBottom = 56, kPanel = 400, kGap = 24, kRow = 22;
/// Damage value at which half of the collagen is damaged: 255 * (1 - exp(-Omega)).
constexpr std::uint8_t kHalf = 128;

std::string Number(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

class Drawing {
 public:
  Drawing(const CutMap& map, const std::string& title)
      : map_(map),
        scale_(std::clamp(kWanted / std::max(map.removed.width, map.removed.height), kLeastScale, kMostScale)),
        width_(scale_ * map.removed.width),
        height_(scale_ * map.removed.height),
        canvas_(kLeft + width_ + kGap + kPanel, std::max(kTop + height_ + kBottom, kTop + kPanelHeight), kPaper) {
    canvas_.Text(kLeft + 24, 14, title, kInk);
  }

  std::string Run() {
    canvas_.Clip(kLeft, kTop, kLeft + width_, kTop + height_);
    DrawTexels();
    DrawTouched();
    DrawCentreLine();
    DrawWays();
    canvas_.Unclip();
    DrawAxes();
    DrawPanel();
    return canvas_.Png();
  }

 private:
  static constexpr int kPanelHeight = 860;

  /// Converts texels of the map to pixels; t points upwards.
  [[nodiscard]] Vec2d ToPixel(const Vec2d& texel) const {
    return {kLeft + scale_ * texel.x(), kTop + height_ - scale_ * texel.y()};
  }

  [[nodiscard]] Rgb ColourOf(int x, int y) const {
    if (map_.removed.At(x, y)) return kHole;
    if (map_.islands.At(x, y)) return kIsland;
    const SheetTexels& texels = map_.recorded.texels;
    const int column = x + map_.x0, row = y + map_.y0;
    if (column < 0 || row < 0 || column >= texels.width || row >= texels.height) return kPaper;
    const std::uint8_t heat = texels.temperature[texels.Index(column, row)];
    return heat == 0 ? kHeats.front().colour : HeatColour(20 + 0.5 * heat);
  }

  [[nodiscard]] bool IsDamaged(int x, int y) const {
    const SheetTexels& texels = map_.recorded.texels;
    const int column = x + map_.x0, row = y + map_.y0;
    return column >= 0 && row >= 0 && column < texels.width && row < texels.height &&
           texels.damage[texels.Index(column, row)] >= kHalf;
  }

  void DrawTexels() {
    for (int y = 0; y < map_.removed.height; ++y) {
      const int top = kTop + height_ - scale_ * (y + 1);
      for (int x = 0; x < map_.removed.width; ++x) {
        const int left = kLeft + scale_ * x;
        canvas_.Box(left, top, left + scale_, top + scale_, ColourOf(x, y));
        if (map_.removed.At(x, y) || !IsDamaged(x, y)) continue;
        // Border of the region in which at least half of the collagen is damaged.
        if (!IsDamaged(x - 1, y)) canvas_.Box(left, top, left + 1, top + scale_, kDamaged);
        if (!IsDamaged(x + 1, y)) canvas_.Box(left + scale_ - 1, top, left + scale_, top + scale_, kDamaged);
        if (!IsDamaged(x, y + 1)) canvas_.Box(left, top, left + scale_, top + 1, kDamaged);
        if (!IsDamaged(x, y - 1)) canvas_.Box(left, top + scale_ - 1, left + scale_, top + scale_, kDamaged);
      }
    }
  }

  void DrawTouched() {
    for (const MetalFrame& frame : map_.recorded.metal) {
      if (frame.mode == CauteryMode::kOff) continue;
      for (const Vec2f& place : frame.touched) canvas_.Dot(ToPixel(map_.ToTexel(place)), 1.0, kTouched, 0.10);
    }
  }

  void DrawWays() {
    const MetalFrame* last = nullptr;
    for (const MetalFrame& frame : map_.recorded.metal) {
      if (frame.goes_on && last != nullptr) {
        const bool on = frame.mode != CauteryMode::kOff;
        canvas_.Line(ToPixel(map_.ToTexel(last->centre)), ToPixel(map_.ToTexel(frame.centre)), on ? 2.0 : 1.0,
                     on ? kMetal : kIdleMetal);
      }
      last = frame.in_contact ? &frame : nullptr;
    }
    const CurrentSample* before = nullptr;
    for (const CurrentSample& sample : map_.recorded.current) {
      const bool on = sample.energised() && sample.touching;
      if (on) {
        const Vec2d at = ToPixel(map_.ToTexel(sample.material));
        if (before != nullptr) canvas_.Line(ToPixel(map_.ToTexel(before->material)), at, 1.2, kCurrent);
        canvas_.Dot(at, 1.6, kCurrent);
      }
      before = on ? &sample : nullptr;
    }
  }

  void DrawCentreLine() {
    for (const CentreLine::Stretch& stretch : map_.centre_line.stretches) {
      for (std::size_t i = 1; i < stretch.points.size(); ++i) {
        canvas_.Line(ToPixel(stretch.points[i - 1].place), ToPixel(stretch.points[i].place), 2.4, kCentre);
      }
      if (stretch.closed) {
        canvas_.Line(ToPixel(stretch.points.back().place), ToPixel(stretch.points.front().place), 2.4, kCentre);
      }
    }
  }

  void DrawAxes() {
    const double texel_mm = 1e3 * map_.recorded.texels.texel_m;
    const Vec2d low = 1e3 * map_.ToSheet({0, 0}), high = 1e3 * map_.ToSheet({map_.removed.width, map_.removed.height});
    const double step = std::max(high.x() - low.x(), high.y() - low.y()) > 25 ? 5 : 2;
    const int bottom = kTop + height_;
    for (double s = step * std::ceil(low.x() / step); s <= high.x(); s += step) {
      const int x = kLeft + static_cast<int>(std::lround(scale_ * (s - low.x()) / texel_mm));
      canvas_.Box(x, bottom, x + 1, bottom + 6, kInk);
      const std::string label = Number(s, 0);
      canvas_.Text(x - Canvas::TextWidth(label) / 2, bottom + 9, label, kInk);
    }
    for (double t = step * std::ceil(low.y() / step); t <= high.y(); t += step) {
      const int y = bottom - static_cast<int>(std::lround(scale_ * (t - low.y()) / texel_mm));
      canvas_.Box(kLeft - 6, y, kLeft, y + 1, kInk);
      const std::string label = Number(t, 0);
      canvas_.Text(kLeft - 10 - Canvas::TextWidth(label), y - Canvas::kLetterHeight, label, kInk);
    }
    canvas_.Text(kLeft + width_ / 2 - Canvas::TextWidth("s [mm]") / 2, bottom + 32, "s [mm]", kInk);
    canvas_.Text(4, 14, "t [mm]", kInk);
    canvas_.Box(kLeft - 1, kTop, kLeft, bottom + 1, kInk);
    canvas_.Box(kLeft - 1, bottom, kLeft + width_, bottom + 1, kInk);
    const int bar = static_cast<int>(std::lround(scale_ / texel_mm));
    canvas_.Box(kLeft + 12, bottom - 16, kLeft + 12 + bar, bottom - 10, kInk);
    canvas_.Text(kLeft + 20 + bar, bottom - 22, "1 mm", kInk);
  }

  void DrawPanel() {
    const int x = kLeft + width_ + kGap;
    int y = kTop;
    const auto swatch = [&](const Rgb& colour, const char* label, int thickness) {
      canvas_.Box(x, y + 8 - thickness / 2, x + 28, y + 8 - thickness / 2 + thickness, colour);
      canvas_.Text(x + 38, y, label, kInk);
      y += kRow;
    };
    swatch(kHole, "hole", 14);
    swatch(kIsland, "island of living tissue", 14);
    swatch(kCentre, "centre line of the hole", 4);
    swatch(kMetal, "path of the metal, energised", 3);
    swatch(kIdleMetal, "path of the metal, idle", 3);
    swatch(kTouched, "touched by energised metal", 8);
    swatch(kCurrent, "reported place of the current", 3);
    swatch(kDamaged, "half of the collagen damaged", 1);
    y += 6;
    const int step = kPanel / static_cast<int>(kHeats.size()) - 16;
    canvas_.Text(x, y, "highest temperature [C]", kInk);
    y += kRow;
    const double coldest = kHeats.front().temperature_C, hottest = kHeats.back().temperature_C;
    const int length = step * (static_cast<int>(kHeats.size()) - 1);
    for (int i = 0; i < length; ++i) {
      canvas_.Box(x + i, y, x + i + 1, y + 14, HeatColour(std::lerp(coldest, hottest, 1.0 * i / length)));
    }
    for (const Heat& heat : kHeats) {
      const double f = (heat.temperature_C - coldest) / (hottest - coldest);
      canvas_.Text(x + static_cast<int>(f * length) - 10, y + 18, heat.label, kSoft);
    }
    y += 54;
    for (const auto& [name, value] : FigureList(map_.figures)) {
      canvas_.Text(x, y, name, kSoft);
      const bool whole = value == std::floor(value) && std::abs(value) < 1e6;
      const std::string text = Number(value, whole ? 0 : std::abs(value) < 10 ? 2 : 1);
      canvas_.Text(x + kPanel - 20 - Canvas::TextWidth(text), y, text, kInk);
      y += kRow;
    }
  }

  const CutMap& map_;
  const int scale_, width_, height_;
  Canvas canvas_;
};

}  // namespace

std::string DrawCutMap(const CutMap& map, const std::string& title) { return Drawing(map, title).Run(); }

}  // namespace fulcrum::log_tools
