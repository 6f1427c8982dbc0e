// The statistics of pictures on pictures whose answers are known.
#include "tests/support/picture_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <unsupported/Eigen/FFT>

#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

/// A picture whose channels all are value(x, y), rounded to 8 bits.
template <class Value>
Bitmap GreyPicture(int width, int height, const Value& value) {
  Bitmap picture{width, height, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto level = static_cast<std::uint8_t>(std::lround(std::clamp<double>(value(x, y), 0, 255)));
      picture.rgb.insert(picture.rgb.end(), 3, level);
    }
  }
  return picture;
}

Bitmap Plane(int width, int height, const std::array<std::uint8_t, 3>& colour) {
  Bitmap picture{width, height, {}};
  for (int i = 0; i < width * height; ++i) picture.rgb.insert(picture.rgb.end(), colour.begin(), colour.end());
  return picture;
}

RoundField Middle(const Bitmap& picture, float radius) {
  return {{0.5f * static_cast<float>(picture.width), 0.5f * static_cast<float>(picture.height)}, radius};
}

TEST(PictureColour, OfAPlaneIsItsColour) {
  const Bitmap picture = Plane(120, 80, {150, 60, 75});
  const ColourStatistics colour = MeasureColour(picture, Middle(picture, 30));
  EXPECT_EQ(colour.rgb[0].mean, 150);
  EXPECT_EQ(colour.rgb[1].p05, 60);
  EXPECT_EQ(colour.rgb[2].p95, 75);
  EXPECT_DOUBLE_EQ(colour.red_to_green, 2.5);
  EXPECT_DOUBLE_EQ(colour.red_to_blue, 2);
  // HSV: hue 60 (G - B) / (R - min), saturation 1 - min / max.
  EXPECT_DOUBLE_EQ(colour.mean_colour.hue_deg, -10);
  EXPECT_DOUBLE_EQ(colour.hue_deg.p50, -10);
  EXPECT_DOUBLE_EQ(colour.mean_colour.saturation, 0.6);
  EXPECT_DOUBLE_EQ(colour.saturation.p95, 0.6);
  EXPECT_EQ(colour.red_most, 1);
  EXPECT_NEAR(colour.border_to_centre, 1, 1e-6);
}

TEST(PictureColour, HuesOfTheSixCorners) {
  EXPECT_EQ(HueSaturationOf({255, 0, 0}).hue_deg, 0);
  EXPECT_EQ(HueSaturationOf({255, 255, 0}).hue_deg, 60);
  EXPECT_EQ(HueSaturationOf({0, 255, 0}).hue_deg, 120);
  EXPECT_EQ(HueSaturationOf({0, 255, 255}).hue_deg, 180);
  EXPECT_EQ(HueSaturationOf({0, 0, 255}).hue_deg, -120);
  EXPECT_EQ(HueSaturationOf({255, 0, 255}).hue_deg, -60);
  EXPECT_EQ(HueSaturationOf({90, 90, 90}).saturation, 0);
}

TEST(PictureColour, CountsOnlyTheField) {
  Bitmap picture = Plane(100, 100, {0, 0, 0});
  const RoundField field = Middle(picture, 20);
  for (const std::size_t pixel : PixelsIn(picture, field)) picture.rgb[3 * pixel] = 200;
  const ColourStatistics colour = MeasureColour(picture, field);
  EXPECT_EQ(colour.rgb[0].p05, 200);
  EXPECT_EQ(colour.mean_colour.saturation, 1);
  EXPECT_NEAR(static_cast<double>(PixelsIn(picture, field).size()), std::numbers::pi * 400, 10);
}

TEST(PictureColour, OfADarkBorder) {
  const auto shade = [](int x, int y) { return std::hypot(x - 99.5, y - 99.5) > 80 ? 50 : 200; };
  const Bitmap picture = GreyPicture(200, 200, shade);
  EXPECT_NEAR(MeasureColour(picture, Middle(picture, 100)).border_to_centre, 0.25, 1e-6);
}

TEST(PictureSpecular, FindsDiscsOfKnownNumberAndArea) {
  constexpr int kRows = 3, kColumns = 4, kPitch = 60;
  Bitmap picture = Plane(kColumns * kPitch, kRows * kPitch, {140, 70, 65});
  std::vector<double> areas;
  for (int disc = 0; disc < kRows * kColumns; ++disc) {
    const double radius = 2 + 0.5 * disc;
    const int cx = disc % kColumns * kPitch + kPitch / 2, cy = disc / kColumns * kPitch + kPitch / 2;
    double area = 0;
    for (int y = cy - 12; y <= cy + 12; ++y) {
      for (int x = cx - 12; x <= cx + 12; ++x) {
        if (std::hypot(x - cx, y - cy) > radius) continue;
        std::fill_n(&picture.rgb[3 * TexelIndex(x, y, picture.width)], 3, std::uint8_t{250});
        ++area;
      }
    }
    areas.push_back(area);
  }
  const RoundField field = Middle(picture, 500);
  const SpecularStatistics specular = MeasureSpecular(picture, field);
  double sum = 0;
  for (const double area : areas) sum += area;
  EXPECT_EQ(specular.spots, areas.size());
  EXPECT_DOUBLE_EQ(specular.share, sum / static_cast<double>(picture.width * picture.height));
  EXPECT_DOUBLE_EQ(specular.near_white, specular.share);
  EXPECT_DOUBLE_EQ(specular.area_p50, 0.5 * (areas[5] + areas[6]));
  EXPECT_GT(specular.area_p90, areas[9]);
  EXPECT_LT(specular.area_p90, areas[11]);
}

TEST(PictureSpecular, FindsADimHighlightByItsSurroundings) {
  Bitmap picture = Plane(200, 200, {60, 30, 28});
  for (int y = 98; y < 102; ++y) {
    for (int x = 98; x < 103; ++x) std::fill_n(&picture.rgb[3 * TexelIndex(x, y, 200)], 3, std::uint8_t{140});
  }
  const SpecularStatistics specular = MeasureSpecular(picture, Middle(picture, 90));
  EXPECT_EQ(specular.spots, 1u);
  EXPECT_EQ(specular.area_p50, 20);
  EXPECT_EQ(specular.near_white, 0);
}

TEST(PictureSpecular, APlaneAndShadingHaveNone) {
  const Bitmap plane = Plane(150, 150, {180, 90, 85});
  EXPECT_EQ(MeasureSpecular(plane, Middle(plane, 70)).spots, 0u);
  const Bitmap ramp = GreyPicture(200, 200, [](int x, int) { return 40 + 0.8 * x; });
  EXPECT_EQ(MeasureSpecular(ramp, Middle(ramp, 90)).spots, 0u);
}

TEST(PictureSpecular, NothingOutsideTheFieldCounts) {
  Bitmap picture = Plane(200, 200, {255, 255, 255});
  const RoundField field = Middle(picture, 60);
  for (const std::size_t pixel : PixelsIn(picture, field)) {
    for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * pixel + c] = static_cast<std::uint8_t>(120 - 30 * c);
  }
  EXPECT_EQ(MeasureSpecular(picture, field).spots, 0u);
}

TEST(PictureSpecular, DiagonalNeighboursAreOneComponent) {
  const std::vector<char> mask{1, 0, 0, 0,  //
                               0, 1, 0, 1,  //
                               0, 0, 0, 1};
  EXPECT_EQ(ComponentAreas(mask, 4), (std::vector<double>{2, 2}));
}

/// A field of random phases whose amplitude falls with frequency^slope.
Bitmap Noise(int size, double slope) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
  const auto n = static_cast<std::size_t>(size);
  std::vector<std::vector<std::complex<double>>> lines(n, std::vector<std::complex<double>>(n));
  for (int v = 0; v < size; ++v) {
    for (int u = 0; u < size; ++u) {
      const double f = std::hypot(std::min(u, size - u), std::min(v, size - v));
      lines[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)] =
          f > 0 ? std::polar(std::pow(f, slope), phase(random)) : 0;
    }
  }
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> out;
  for (auto& line : lines) {
    fft.inv(out, line);
    line = out;
  }
  std::vector<double> values(n * n);
  double squares = 0;
  for (std::size_t x = 0; x < n; ++x) {
    std::vector<std::complex<double>> column(n);
    for (std::size_t y = 0; y < n; ++y) column[y] = lines[y][x];
    fft.inv(out, column);
    for (std::size_t y = 0; y < n; ++y) squares += std::pow(values[y * n + x] = out[y].real(), 2);
  }
  const double scale = 35 / std::sqrt(squares / static_cast<double>(n * n));
  return GreyPicture(size, size, [&](int x, int y) { return 128 + scale * values[TexelIndex(x, y, size)]; });
}

TEST(PictureSpectrum, SlopeOfNoiseIsThatOfItsAmplitudes) {
  for (const double slope : {-0.7, -1.0, -1.5}) {
    const Bitmap picture = Noise(1024, slope);
    const SpectrumStatistics spectrum = MeasureSpectrum(picture, Middle(picture, 2000));
    EXPECT_EQ(spectrum.windows, 49);
    EXPECT_NEAR(spectrum.slope, slope, 0.05);
  }
}

TEST(PictureSpectrum, AUniformPictureHasNone) {
  const Bitmap picture = Plane(300, 300, {90, 60, 60});
  EXPECT_EQ(MeasureSpectrum(picture, Middle(picture, 400)).slope, 0);
  EXPECT_EQ(MeasureSpectrum(picture, Middle(picture, 100)).windows, 0);
}

/// A step blurred by a Gaussian passes from 10 to 90 % in 2.563 standard deviations.
TEST(PictureEdges, WidthOfABlurredStep) {
  for (const double sigma : {1.0, 2.0, 4.0}) {
    for (const double turn : {0.0, 0.4, 1.2}) {
      const Bitmap picture = GreyPicture(160, 160, [&](int x, int y) {
        const double d = std::cos(turn) * (x - 80.3) + std::sin(turn) * (y - 79.6);
        return 128 + 100 * std::erf(d / (sigma * std::numbers::sqrt2));
      });
      const EdgeStatistics edges = MeasureEdges(picture, Middle(picture, 70));
      EXPECT_NEAR(edges.width_p50, 2.563 * sigma, 0.1 * 2.563 * sigma) << sigma << ' ' << turn;
      EXPECT_GT(edges.edges, 80u);
    }
  }
}

/// Between two pixels, with values linear in between: 80 % of a pixel.
TEST(PictureEdges, WidthAndShareOfASharpStep) {
  const Bitmap picture = GreyPicture(160, 160, [](int x, int) { return x < 80 ? 60 : 180; });
  const EdgeStatistics edges = MeasureEdges(picture, Middle(picture, 70));
  EXPECT_NEAR(edges.width_p50, 0.8, 0.05);
  const double columns = 2 * 2 * std::sqrt(70.0 * 70 - 0.25);  // Two columns of pixels, each a chord.
  EXPECT_NEAR(edges.share, columns / (std::numbers::pi * 70 * 70), 4e-4);
}

TEST(PictureEdges, ShadingHasNone) {
  const Bitmap picture = GreyPicture(200, 200, [](int x, int) { return 20 + x; });
  const EdgeStatistics edges = MeasureEdges(picture, Middle(picture, 90));
  EXPECT_EQ(edges.share, 0);
  EXPECT_EQ(edges.edges, 0u);
}

}  // namespace
}  // namespace fulcrum::render
