// Specular highlights of a picture: the part of picture_statistics.h after Arnold et al. 2010.
#include <algorithm>
#include <cmath>
#include <utility>

#include "render_node/geometry/texel.h"
#include "tests/support/picture_statistics.h"
#include "tests/support/quantile.h"

namespace fulcrum::render {
namespace {

using Channel = std::vector<std::uint8_t>;

using benchmark::Quantile;

/// Connected pixels of a mask, diagonals included.
class Components {
 public:
  Components(std::span<const char> mask, int width) : labels_(mask.size(), -1) {
    const int height = static_cast<int>(mask.size()) / width;
    std::vector<std::size_t> open;
    for (std::size_t seed = 0; seed < mask.size(); ++seed) {
      if (mask[seed] == 0 || labels_[seed] >= 0) continue;
      const int label = static_cast<int>(pixels_.size());
      pixels_.emplace_back();
      labels_[seed] = label;
      open.push_back(seed);
      while (!open.empty()) {
        const std::size_t pixel = open.back();
        open.pop_back();
        pixels_.back().push_back(pixel);
        const int x = static_cast<int>(pixel) % width, y = static_cast<int>(pixel) / width;
        for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v) {
          for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) {
            const std::size_t next = TexelIndex(u, v, width);
            if (mask[next] != 0 && labels_[next] < 0) {
              labels_[next] = label;
              open.push_back(next);
            }
          }
        }
      }
    }
  }
  [[nodiscard]] const std::vector<std::vector<std::size_t>>& pixels() const { return pixels_; }

 private:
  std::vector<int> labels_;
  std::vector<std::vector<std::size_t>> pixels_;
};

/// Replaces each component of `bright` by the mean colour of the pixels 3 or 4 beside it. One without such a neighbour
/// keeps its colour.
void FillFromAround(std::span<const char> bright, const std::vector<char>& in_field, int width,
                    std::array<Channel, 3>* rgb) {
  constexpr int kNear = 2, kFar = 4;
  const int height = static_cast<int>(bright.size()) / width;
  std::vector<std::size_t> seen(bright.size(), 0);  // Number of the component by which a pixel was looked at, from 1.
  std::size_t number = 0;
  const Components components(bright, width);
  for (const auto& component : components.pixels()) {
    ++number;
    const auto around = [&](int reach, const auto& visit) {
      for (const std::size_t pixel : component) {
        const int x = static_cast<int>(pixel) % width, y = static_cast<int>(pixel) / width;
        for (int v = std::max(0, y - reach); v <= std::min(height - 1, y + reach); ++v) {
          for (int u = std::max(0, x - reach); u <= std::min(width - 1, x + reach); ++u) {
            const std::size_t near = TexelIndex(u, v, width);
            if (seen[near] == number) continue;
            seen[near] = number;
            visit(near);
          }
        }
      }
    };
    around(kNear, [](std::size_t) {});
    std::array<double, 3> sum{};
    double count = 0;
    around(kFar, [&](std::size_t pixel) {
      if (bright[pixel] != 0 || in_field[pixel] == 0) return;
      for (std::size_t c = 0; c < 3; ++c) sum[c] += (*rgb)[c][pixel];
      ++count;
    });
    if (count == 0) continue;
    for (const std::size_t pixel : component) {
      for (std::size_t c = 0; c < 3; ++c) (*rgb)[c][pixel] = static_cast<std::uint8_t>(std::lround(sum[c] / count));
    }
  }
}

/// Median over 31 x 31 pixels, of those in the field. 0 outside the field.
Channel MedianFiltered(const Channel& values, const std::vector<char>& in_field, int width) {
  constexpr int kReach = 15;
  const int height = static_cast<int>(values.size()) / width;
  Channel filtered(values.size(), 0);
  std::array<int, 256> histogram;
  for (int y = 0; y < height; ++y) {
    histogram.fill(0);
    int count = 0, median = 0, below = 0;  // `below`: values under `median`.
    const int bottom = std::max(0, y - kReach), top = std::min(height - 1, y + kReach);
    const auto change = [&](int x, int by) {
      if (x < 0 || x >= width) return;
      for (int v = bottom; v <= top; ++v) {
        const std::size_t pixel = TexelIndex(x, v, width);
        if (in_field[pixel] == 0) continue;
        histogram[values[pixel]] += by;
        count += by;
        if (values[pixel] < median) below += by;
      }
    };
    for (int x = -kReach; x < kReach; ++x) change(x, 1);
    for (int x = 0; x < width; ++x) {
      change(x + kReach, 1);
      change(x - kReach - 1, -1);
      const std::size_t pixel = TexelIndex(x, y, width);
      if (in_field[pixel] == 0) continue;
      while (below > count / 2) below -= histogram[static_cast<std::size_t>(--median)];
      while (below + histogram[static_cast<std::size_t>(median)] <= count / 2) {
        below += histogram[static_cast<std::size_t>(median++)];
      }
      filtered[pixel] = static_cast<std::uint8_t>(median);
    }
  }
  return filtered;
}

/// Criteria of the two modules over one picture.
class ArnoldDetector {
 public:
  ArnoldDetector(const Bitmap& picture, const RoundField& field)
      : width_(picture.width), pixels_(PixelsIn(picture, field)), grey_(Grey(picture)), in_field_(grey_.size(), 0) {
    for (std::size_t c = 0; c < 3; ++c) {
      rgb_[c].resize(grey_.size());
      for (std::size_t i = 0; i < grey_.size(); ++i) rgb_[c][i] = picture.rgb[3 * i + c];
    }
    for (const std::size_t pixel : pixels_) in_field_[pixel] = 1;
    const auto bright = [&](const auto& values) {
      std::vector<double> all;
      for (const std::size_t pixel : pixels_) all.push_back(static_cast<double>(values[pixel]));
      return pixels_.empty() ? 0.0 : Quantile(all, 0.95);
    };
    const double grey = std::max(1.0, bright(grey_));
    green_ = bright(rgb_[1]) / grey;
    blue_ = bright(rgb_[2]) / grey;
  }

  [[nodiscard]] std::size_t size() const { return pixels_.size(); }

  /// Module 1.
  [[nodiscard]] std::vector<char> Absolute(double threshold) const {
    std::vector<char> mask(grey_.size(), 0);
    for (const std::size_t i : pixels_) {
      mask[i] = static_cast<char>(rgb_[1][i] > green_ * threshold || rgb_[2][i] > blue_ * threshold ||
                                  double{grey_[i]} > threshold);
    }
    return mask;
  }

  /// Module 2.
  [[nodiscard]] std::vector<char> Relative(double absolute, double relative) const {
    constexpr float kTooDark = 25.5f;
    std::array<Channel, 3> filled = rgb_;
    FillFromAround(Absolute(absolute), in_field_, width_, &filled);
    std::vector<char> mask(grey_.size(), 0);
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0, squares = 0;
      for (const std::size_t i : pixels_) {
        const double value = rgb_[c][i];
        sum += value;
        squares += value * value;
      }
      const double n = static_cast<double>(pixels_.size()), mean = sum / n;
      const double tau = mean / (mean + std::sqrt(std::max(0.0, squares / n - mean * mean)));
      const Channel median = MedianFiltered(filled[c], in_field_, width_);
      for (const std::size_t i : pixels_) {
        if (grey_[i] > kTooDark && tau * rgb_[c][i] > relative * std::max<int>(1, median[i])) mask[i] = 1;
      }
    }
    return mask;
  }

 private:
  int width_;
  std::vector<std::size_t> pixels_;
  std::vector<float> grey_;
  std::vector<char> in_field_;
  std::array<Channel, 3> rgb_;
  double green_ = 1, blue_ = 1;  // Ratios of the bright quantiles to that of the grey value.
};

/// What either module finds.
std::vector<char> SpecularOf(const ArnoldDetector& detector, const SpecularThresholds& thresholds) {
  std::vector<char> mask = detector.Absolute(thresholds.t1);
  if (detector.size() == 0) return mask;
  const std::vector<char> relative = detector.Relative(thresholds.t2_abs, thresholds.t2);
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = static_cast<char>(mask[i] | relative[i]);
  return mask;
}

}  // namespace

std::vector<double> ComponentAreas(std::span<const char> mask, int width) {
  std::vector<double> areas;
  const Components components(mask, width);
  for (const auto& component : components.pixels()) areas.push_back(static_cast<double>(component.size()));
  return areas;
}

std::vector<char> SpecularPixels(const Bitmap& picture, const RoundField& field, const SpecularThresholds& thresholds) {
  return SpecularOf(ArnoldDetector(picture, field), thresholds);
}

SpecularStatistics MeasureSpecular(const Bitmap& picture, const RoundField& field,
                                   const SpecularThresholds& thresholds) {
  SpecularStatistics statistics;
  const ArnoldDetector detector(picture, field);
  if (detector.size() == 0) return statistics;
  const auto share = [&](const std::vector<char>& mask) {
    return static_cast<double>(std::ranges::count(mask, char{1})) / static_cast<double>(detector.size());
  };
  const std::vector<char> mask = SpecularOf(detector, thresholds);
  statistics.share = share(mask);
  statistics.near_white = share(detector.Absolute(thresholds.t1));
  const std::vector<double> areas = ComponentAreas(mask, picture.width);
  statistics.spots = areas.size();
  if (!areas.empty()) {
    statistics.area_p50 = Quantile(areas, 0.5);
    statistics.area_p90 = Quantile(areas, 0.9);
  }
  return statistics;
}

}  // namespace fulcrum::render
