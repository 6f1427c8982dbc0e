#include "tests/support/picture_statistics.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "render_node/geometry/texel.h"
#include "tests/support/quantile.h"

namespace fulcrum::render {
namespace {

using benchmark::Quantile;

Quantiles Summary(const std::vector<double>& values) {
  if (values.empty()) return {};
  double sum = 0;
  for (const double value : values) sum += value;
  return {sum / static_cast<double>(values.size()), Quantile(values, 0.05), Quantile(values, 0.5),
          Quantile(values, 0.95)};
}

/// The grey values as a function of the place [pixels, 0 in the middle of the first pixel], linear between pixels.
class GreyField {
 public:
  explicit GreyField(const Bitmap& picture)
      : width_(picture.width), height_(picture.height), grey_(render::Grey(picture)) {}
  [[nodiscard]] double At(double x, double y) const {
    const double u = std::clamp(x, 0.0, width_ - 1.001), v = std::clamp(y, 0.0, height_ - 1.001);
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    return std::lerp(std::lerp(double{Of(i, j)}, double{Of(i + 1, j)}, u - i),
                     std::lerp(double{Of(i, j + 1)}, double{Of(i + 1, j + 1)}, u - i), v - j);
  }
  /// By central differences [1/pixel]. @pre 0 < x < width - 1, 0 < y < height - 1.
  [[nodiscard]] Vec2d Gradient(int x, int y) const {
    return {0.5 * (Of(x + 1, y) - Of(x - 1, y)), 0.5 * (Of(x, y + 1) - Of(x, y - 1))};
  }

 private:
  [[nodiscard]] float Of(int x, int y) const { return grey_[TexelIndex(x, y, width_)]; }

  int width_, height_;
  std::vector<float> grey_;
};

/// Width of the edge through (x, y) along `direction` (unit, upwards), or 0 where there is no step that counts.
double EdgeWidth(const GreyField& grey, int x, int y, const Vec2d& direction) {
  constexpr double kStep = 0.125;     // [pixels]
  constexpr int kStride = 8;          // Slopes are taken over a pixel.
  constexpr int kMost = 16 * 8;       // Wider than 32 pixels is shading.
  constexpr double kShare = 0.05;     // Of the greatest slope; below it the step has ended.
  constexpr double kRounding = 0.75;  // [1/pixel] Slopes of 8-bit values below it mean nothing.
  const auto at = [&](int k) { return grey.At(x + k * kStep * direction.x(), y + k * kStep * direction.y()); };
  const double least = std::max(kRounding, kShare * (at(kStride / 2) - at(-kStride / 2)));
  const auto end = [&](int way) {
    int k = 0;
    while (std::abs(k) < kMost && way * (at(k + way * kStride) - at(k)) > least) k += way;
    return k;
  };
  const int low = end(-1), high = end(1);
  const double bottom = at(low), top = at(high), step = top - bottom;
  if (step < EdgeStatistics::kLeastStep || std::max(-low, high) >= kMost) return 0;
  const auto passes = [&](double level) {
    int k = low;
    while (k < high && at(k + 1) < level) ++k;
    const double before = at(k), after = at(k + 1);
    return k + (after > before ? (level - before) / (after - before) : 0.0);
  };
  return kStep * (passes(bottom + 0.9 * step) - passes(bottom + 0.1 * step));
}

/// Amplitudes of one window, added to `sums` by the distance of the frequency from 0 in cycles a window.
class WindowSpectrum {
 public:
  WindowSpectrum() {
    for (int k = 0; k < kSize; ++k) {
      hann_[static_cast<std::size_t>(k)] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (k + 0.5) / kSize);
    }
  }
  template <class AddAmplitude>
  void Add(const std::vector<float>& grey, int width, int left, int bottom, const AddAmplitude& add) {
    double mean = 0;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) mean += grey[TexelIndex(left + x, bottom + y, width)];
    }
    mean /= kSize * kSize;
    std::vector<std::vector<std::complex<double>>> rows(kSize);
    std::vector<std::complex<double>> line(kSize);
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        line[Place(x)] = hann_[Place(x)] * hann_[Place(y)] * (grey[TexelIndex(left + x, bottom + y, width)] - mean);
      }
      fft_.fwd(rows[Place(y)], line);
    }
    std::vector<std::complex<double>> column(kSize), spectrum;
    for (int u = 0; u < kSize; ++u) {
      for (int y = 0; y < kSize; ++y) column[Place(y)] = rows[Place(y)][Place(u)];
      fft_.fwd(spectrum, column);
      for (int v = 0; v < kSize; ++v) {
        add(std::hypot(std::min(u, kSize - u), std::min(v, kSize - v)), std::abs(spectrum[Place(v)]));
      }
    }
  }

 private:
  static constexpr int kSize = SpectrumStatistics::kWindow;
  static std::size_t Place(int k) { return static_cast<std::size_t>(k); }

  std::array<double, kSize> hann_{};
  Eigen::FFT<double> fft_;
};

}  // namespace

std::vector<std::size_t> PixelsIn(const Bitmap& picture, const RoundField& field) {
  std::vector<std::size_t> pixels;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (field.Contains(x, y)) pixels.push_back(TexelIndex(x, y, picture.width));
    }
  }
  return pixels;
}

std::vector<float> Grey(const Bitmap& picture) {
  std::vector<float> grey(picture.rgb.size() / 3);
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const std::uint8_t* rgb = &picture.rgb[3 * i];
    grey[i] = 0.2989f * static_cast<float>(rgb[0]) + 0.5870f * static_cast<float>(rgb[1]) +
              0.1140f * static_cast<float>(rgb[2]);
  }
  return grey;
}

HueSaturation HueSaturationOf(const std::array<double, 3>& rgb) {
  const auto [r, g, b] = rgb;
  const double most = std::max({r, g, b}), range = most - std::min({r, g, b});
  if (range <= 0) return {};
  double hue = 0;  // In sixths of the circle.
  if (most == r) {
    hue = (g - b) / range;
  } else if (most == g) {
    hue = 2 + (b - r) / range;
  } else {
    hue = 4 + (r - g) / range;
  }
  return {60 * (hue > 3 ? hue - 6 : hue), range / most};
}

ColourStatistics MeasureColour(const Bitmap& picture, const RoundField& field) {
  ColourStatistics statistics;
  const std::vector<std::size_t> pixels = PixelsIn(picture, field);
  if (pixels.empty()) return statistics;
  const std::vector<float> grey = Grey(picture);
  std::array<std::vector<double>, 3> channels;
  std::vector<double> hue, saturation;
  double red_most = 0, border = 0, centre = 0;
  std::size_t border_pixels = 0, centre_pixels = 0;
  for (const std::size_t pixel : pixels) {
    std::array<double, 3> rgb;
    for (std::size_t c = 0; c < 3; ++c) {
      rgb[c] = picture.rgb[3 * pixel + c];
      channels[c].push_back(rgb[c]);
    }
    const HueSaturation colour = HueSaturationOf(rgb);
    saturation.push_back(colour.saturation);
    const auto [least, most] = std::ranges::minmax(rgb);
    if (most - least >= ColourStatistics::kChromatic) hue.push_back(colour.hue_deg);
    if (rgb[0] >= most) ++red_most;
    const auto width = static_cast<std::size_t>(picture.width);
    const Vec2f place(static_cast<float>(pixel % width) + 0.5f, static_cast<float>(pixel / width) + 0.5f);
    const float radius = (place - field.centre).norm() / field.radius;
    if (radius > 0.85f) {
      border += double{grey[pixel]};
      ++border_pixels;
    } else if (radius < 0.3f) {
      centre += double{grey[pixel]};
      ++centre_pixels;
    }
  }
  std::array<double, 3> mean;
  for (std::size_t c = 0; c < 3; ++c) mean[c] = (statistics.rgb[c] = Summary(channels[c])).mean;
  statistics.hue_deg = Summary(hue);
  statistics.saturation = Summary(saturation);
  statistics.mean_colour = HueSaturationOf(mean);
  statistics.red_to_green = mean[0] / mean[1];
  statistics.red_to_blue = mean[0] / mean[2];
  statistics.red_most = red_most / static_cast<double>(pixels.size());
  if (border_pixels > 0 && centre > 0) {
    statistics.border_to_centre =
        border / static_cast<double>(border_pixels) / (centre / static_cast<double>(centre_pixels));
  }
  return statistics;
}

SpectrumStatistics MeasureSpectrum(const Bitmap& picture, const RoundField& field) {
  constexpr int kSize = SpectrumStatistics::kWindow, kBinsPerOctave = 4;
  SpectrumStatistics statistics;
  const auto bins = static_cast<std::size_t>(
      std::lround(kBinsPerOctave * std::log2(SpectrumStatistics::kHighest / SpectrumStatistics::kLowest)));
  struct Bin {
    double amplitude = 0, log_frequency = 0, count = 0;
  };
  std::vector<Bin> sums(bins);
  const auto add = [&](double cycles, double amplitude) {
    const double octaves = std::log2(cycles / kSize / SpectrumStatistics::kLowest);
    if (!(octaves >= 0) || octaves >= static_cast<double>(bins) / kBinsPerOctave) return;
    Bin& bin = sums[static_cast<std::size_t>(kBinsPerOctave * octaves)];
    bin.amplitude += amplitude;
    bin.log_frequency += octaves;
    ++bin.count;
  };
  const std::vector<float> grey = Grey(picture);
  WindowSpectrum window;
  for (int bottom = 0; bottom + kSize <= picture.height; bottom += kSize / 2) {
    for (int left = 0; left + kSize <= picture.width; left += kSize / 2) {
      const int right = left + kSize - 1, top = bottom + kSize - 1;
      if (field.Contains(left, bottom) && field.Contains(right, bottom) && field.Contains(left, top) &&
          field.Contains(right, top)) {
        window.Add(grey, picture.width, left, bottom, add);
        ++statistics.windows;
      }
    }
  }
  // Line of least squares through the bins.
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const Bin& bin : sums) {
    if (bin.amplitude <= 0) continue;
    const double u = bin.log_frequency / bin.count, v = std::log2(bin.amplitude / bin.count);
    n += 1;
    x += u;
    y += v;
    xx += u * u;
    xy += u * v;
  }
  if (n >= 2) statistics.slope = (n * xy - x * y) / (n * xx - x * x);
  return statistics;
}

std::vector<std::size_t> EdgePixels(const Bitmap& picture) {
  std::vector<std::size_t> edges;
  const auto channel = [&](int x, int y, std::size_t c) {
    return int{picture.rgb[3 * TexelIndex(x, y, picture.width) + c]};
  };
  for (int y = 1; y + 1 < picture.height; ++y) {
    for (int x = 1; x + 1 < picture.width; ++x) {
      int most = 0;
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        for (std::size_t c = 0; c < 3; ++c) {
          most = std::max(most, std::abs(channel(x, y, c) - channel(x + dx, y + dy, c)));
        }
      }
      if (most > kEdgeDifference) edges.push_back(TexelIndex(x, y, picture.width));
    }
  }
  return edges;
}

EdgeStatistics MeasureEdges(const Bitmap& picture, const RoundField& field) {
  constexpr int kMargin = 2;
  EdgeStatistics statistics;
  const auto width = static_cast<std::size_t>(picture.width);
  const auto in_field = [&](std::size_t pixel) {
    return field.Contains(static_cast<int>(pixel % width), static_cast<int>(pixel / width));
  };
  const std::vector<std::size_t> edges = EdgePixels(picture);
  const std::vector<std::size_t> all = PixelsIn(picture, field);
  if (all.empty()) return statistics;
  statistics.share = static_cast<double>(std::ranges::count_if(edges, in_field)) / static_cast<double>(all.size());
  const GreyField grey(picture);
  std::vector<double> widths;
  for (const std::size_t pixel : all) {
    const int x = static_cast<int>(pixel % width), y = static_cast<int>(pixel / width);
    if (x < kMargin || y < kMargin || x + kMargin >= picture.width || y + kMargin >= picture.height) continue;
    const Vec2d gradient = grey.Gradient(x, y);
    const double slope = gradient.norm();
    if (slope < 2) continue;  // A step of kLeastStep with less is wider than 20 pixels.
    const Vec2d direction = gradient / slope;
    const auto along = [&](int way) {
      return grey
          .Gradient(static_cast<int>(std::lround(x + way * direction.x())),
                    static_cast<int>(std::lround(y + way * direction.y())))
          .norm();
    };
    if (along(1) > slope || along(-1) >= slope) continue;
    if (const double wide = EdgeWidth(grey, x, y, direction); wide > 0) widths.push_back(wide);
  }
  statistics.edges = widths.size();
  if (!widths.empty()) statistics.width_p50 = Quantile(widths, 0.5);
  return statistics;
}

}  // namespace fulcrum::render
