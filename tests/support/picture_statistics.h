// What a picture shows to a program that knows nothing of the scene: colour, specular highlights, amplitude spectrum
// and edges, inside the round field of the optics. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "render_node/offscreen/framebuffer.h"
#include "services/base/core/types.h"

namespace fulcrum::render {

/// The pixels (x, y) with (x + 1/2, y + 1/2) within `radius` of `centre` [pixels].
struct RoundField {
  Vec2f centre = Vec2f::Zero();
  float radius = 0;
  [[nodiscard]] bool Contains(int x, int y) const {
    return (Vec2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - centre).squaredNorm() <=
           radius * radius;
  }
};

/// Indices y * width + x of the picture's pixels in the field, row by row.
[[nodiscard]] std::vector<std::size_t> PixelsIn(const Bitmap& picture, const RoundField& field);

/// Grey value E of Arnold et al. 2010, for each pixel of the picture [of 255].
[[nodiscard]] std::vector<float> Grey(const Bitmap& picture);

/// Hue [degrees], 0: red, in (-180, 180], and saturation [0, 1], as in HSV. Of a grey: 0 and 0.
struct HueSaturation {
  double hue_deg = 0, saturation = 0;
};
[[nodiscard]] HueSaturation HueSaturationOf(const std::array<double, 3>& rgb);

struct Quantiles {
  double mean = 0, p05 = 0, p50 = 0, p95 = 0;
};

/// All values 0 if the field has no pixel.
struct ColourStatistics {
  std::array<Quantiles, 3> rgb;   ///< [of 255]
  Quantiles hue_deg, saturation;  ///< Of the pixels; hue only of those whose channels differ by kChromatic or more.
  HueSaturation mean_colour;      ///< Of the means of the channels.
  double red_to_green = 0, red_to_blue = 0;  ///< Of the means; infinite if the picture has no green or blue.
  double red_most = 0;                       ///< Share of the pixels with no channel above the red one.
  double border_to_centre = 0;               ///< Mean grey beyond 0.85 of the field's radius by that within 0.3 of it.
  static constexpr int kChromatic = 8;
};
[[nodiscard]] ColourStatistics MeasureColour(const Bitmap& picture, const RoundField& field);

/// Highlights after M. Arnold, A. Ghosh, S. Ameling and G. Lacey, "Automatic segmentation and inpainting of specular
/// highlights for endoscopic imaging", EURASIP J. Image and Video Processing 2010:814319.
///
/// A pixel is specular (1) if G > r_G t1, B > r_B t1 or E > t1, with r_C the ratio of the 95 % quantiles of C and E, or
/// (2) if one channel is more than t2 m / tau, with m the median of the channel over 31 x 31 pixels in which the pixels
/// found by (1) with t2_abs instead of t1 have the mean colour of their surroundings, and tau = mean / (mean + standard
/// deviation) of the channel over the field; of those by (2) only pixels brighter than a tenth of white count. Instead
/// of the paper's rejection of large areas without a sharp rim (module 3), nothing is rejected. Method and thresholds
/// are those of public implementations of the paper.
struct SpecularThresholds {
  double t1 = 240, t2_abs = 190, t2 = 1.2;
};
struct SpecularStatistics {
  double share = 0;                   ///< Of the field's pixels, by (1) or (2).
  double near_white = 0;              ///< The same by (1) alone.
  std::size_t spots = 0;              ///< Components of connected pixels, diagonals included.
  double area_p50 = 0, area_p90 = 0;  ///< Of the spots [pixels]; 0 without spots.
};
[[nodiscard]] SpecularStatistics MeasureSpecular(const Bitmap& picture, const RoundField& field,
                                                 const SpecularThresholds& thresholds = {});
/// The specular pixels themselves: 1 or 0 for each pixel of the picture.
[[nodiscard]] std::vector<char> SpecularPixels(const Bitmap& picture, const RoundField& field,
                                               const SpecularThresholds& thresholds = {});

/// Areas [pixels] of the connected components, diagonals included, of a mask of the picture's size.
[[nodiscard]] std::vector<double> ComponentAreas(std::span<const char> mask, int width);

/// Amplitude spectrum of the grey values: square windows of kWindow pixels that lie in the field, half a window apart,
/// less their mean, times a Hann window; amplitudes averaged over windows and directions in bins of a quarter octave
/// from kLowest to kHighest [cycles a pixel]. The slope is that of the line of least squares of log amplitude over log
/// frequency.
struct SpectrumStatistics {
  static constexpr int kWindow = 256;
  static constexpr double kLowest = 4.0 / kWindow;  // Below, the window's own spectrum adds to the picture's.
  static constexpr double kHighest = 0.25;          // Above, the sampling of the picture shapes the spectrum.
  int windows = 0;                                  ///< 0: the field is too small; the slope is then 0.
  double slope = 0;                                 ///< Also 0 if all windows are uniform.
};
[[nodiscard]] SpectrumStatistics MeasureSpectrum(const Bitmap& picture, const RoundField& field);

/// Pixels (indices as in PixelsIn) of which a channel differs from one of the four neighbours by more than
/// kEdgeDifference.
constexpr int kEdgeDifference = 24;
[[nodiscard]] std::vector<std::size_t> EdgePixels(const Bitmap& picture);

struct EdgeStatistics {
  double share = 0;  ///< Edge pixels (EdgePixels) of the field's pixels.
  /// Width of an edge [pixels]: distance in which the grey value passes from 10 to 90 % of its step, along the gradient
  /// through a pixel whose gradient is greatest there. The step ends where the slope has fallen to a twentieth of the
  /// greatest; steps below kLeastStep do not count.
  static constexpr double kLeastStep = 40;  // [of 255]
  std::size_t edges = 0;                    ///< Places with a width.
  double width_p50 = 0;                     ///< 0 without edges.
};
[[nodiscard]] EdgeStatistics MeasureEdges(const Bitmap& picture, const RoundField& field);

}  // namespace fulcrum::render
