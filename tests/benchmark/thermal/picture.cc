#include "tests/benchmark/thermal/picture.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <vector>

namespace fulcrum::thermal {
namespace {

constexpr int kPixels = 480;

using Rgb = std::array<std::uint8_t, 3>;

Rgb Mix(const Rgb& a, const Rgb& b, float f) {
  Rgb out;
  for (int c = 0; c < 3; ++c) {
    out[c] = static_cast<std::uint8_t>(std::lerp(static_cast<float>(a[c]), static_cast<float>(b[c]), f));
  }
  return out;
}

Rgb Heat(float theta) {
  constexpr std::array<Rgb, 5> kScale{{{20, 20, 60}, {120, 20, 120}, {230, 60, 40}, {255, 180, 40}, {255, 255, 220}}};
  const float x = std::clamp(theta / 70.0f, 0.0f, 0.999f) * 4;
  const int k = static_cast<int>(x);
  return Mix(kScale[k], kScale[k + 1], x - static_cast<float>(k));
}

}  // namespace

void WritePicture(const ThermalSolver& solver, const SceneView& scene, const Vec2f& centre, float width_m,
                  const std::filesystem::path& file) {
  const HeatField& field = solver.field();
  std::vector<Rgb> pixels(3 * kPixels * kPixels, Rgb{60, 60, 60});
  const auto put = [&](int panel, int x, int y, const Rgb& colour) {
    if (x >= 0 && y >= 0 && x < kPixels && y < kPixels) pixels[(y * 3 + panel) * kPixels + x] = colour;
  };
  for (int y = 0; y < kPixels; ++y) {
    for (int x = 0; x < kPixels; ++x) {
      const Vec2f p =
          centre + width_m * Vec2f(static_cast<float>(x) / kPixels - 0.5f, static_cast<float>(y) / kPixels - 0.5f);
      if (!field.sheet().OnSheet(p)) continue;
      const CellIndex cell = field.sheet().CellOf(p);
      const Tile* tile = field.Find(cell.ix / kTile, cell.iy / kTile);
      const int k = (cell.iy % kTile) * kTile + cell.ix % kTile;
      const bool hole = tile != nullptr && (tile->state.flags[k] & kRemoved) != 0;
      const float theta = tile != nullptr ? tile->theta[ThetaIndex(cell.ix % kTile, cell.iy % kTile)] : 0.0f;
      put(0, x, y, hole ? Rgb{0, 0, 0} : Heat(theta));
      Rgb tissue{235, 170, 150};
      if (tile != nullptr) {
        tissue = Mix(tissue, {250, 240, 225}, 1 - std::exp(-0.3f * tile->state.omega_cell[k]));
        tissue = Mix(tissue, {150, 95, 45}, 1 - std::exp(-tile->state.omega_collagen[k]));
        tissue = Mix(tissue, {90, 50, 20}, 1 - tile->state.water[k]);
        tissue = Mix(tissue, {10, 10, 10}, tile->state.charred[k]);
      }
      put(1, x, y, hole ? Rgb{0, 0, 0} : tissue);
    }
  }
  const std::uint32_t cols = scene.membrane.cols;
  const TopologyBits& bits = solver.topology().committed();
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (scene.membrane_rest_length[e] <= 0) continue;
    const std::size_t node = e / 3;
    const std::size_t other = e % 3 == 0 ? node + 1 : (e % 3 == 1 ? node + cols : node + cols + 1);
    const Vec2f a = scene.membrane_material[node], b = scene.membrane_material[other];
    if ((a - centre).cwiseAbs().maxCoeff() > width_m) continue;
    if (TestBit(bits.dead_edges, e)) continue;
    const float shrink = std::min(1.0f, static_cast<float>(bits.shrink[e]) * kShrinkUnit / 0.3f);
    for (float f = 0; f <= 1; f += 0.01f) {
      const Vec2f q = ((a + f * (b - a) - centre) / width_m + Vec2f(0.5f, 0.5f)) * kPixels;
      put(2, static_cast<int>(q.x()), static_cast<int>(q.y()), Mix({200, 200, 200}, {255, 60, 30}, shrink));
    }
  }
  std::FILE* out = std::fopen(file.c_str(), "wb");
  if (out == nullptr) throw std::runtime_error("cannot write " + file.string());
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = 3 * kPixels;
  image.height = kPixels;
  image.format = PNG_FORMAT_RGB;
  const int good = png_image_write_to_stdio(&image, out, 0, pixels.data(), 0, nullptr);
  std::fclose(out);
  if (good == 0) throw std::runtime_error("cannot write " + file.string() + ": " + image.message);
}

}  // namespace fulcrum::thermal
