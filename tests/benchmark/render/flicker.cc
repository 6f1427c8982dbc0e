// How much edges crawl while the scope creeps by a quarter of a pixel a picture and nothing else moves.
//
// An ideal picture also changes then. It is taken from a sequence R of four by four samples a pixel with the same
// motion, so with I_k the k-th picture of a quality
//   flicker = mean of |(I_k+1 - I_k) - (R_k+1 - R_k)|  [of 255]
// over channels, pictures, and the edge pixels (EdgePixels) of R_k. A constant difference from R does not count; that
// is render.edge_error. The pictures have 8 bits, which alone gives up to half a step. Keys with `plain_` are without
// the smoothing of edges that the node switches on.
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "render_node/geometry/texel.h"
#include "render_node/scene_graph/display.h"
#include "services/base/core/scope.h"
#include "tests/benchmark/render/parts.h"
#include "tests/support/picture_statistics.h"

namespace fulcrum::render {
namespace {

constexpr int kSamples = 4;          // Of the reference, in each direction.
constexpr float kCreep = 0.25f;      // [pixels a picture], of the scope's target.
const Vec2f kDirection(0.8f, 0.6f);  // In the picture, so that edges of every direction move.

/// Means of kSamples x kSamples pixels, times their number.
using Sums = std::vector<std::uint16_t>;

Sums SumsOf(const Bitmap& fine) {
  const int width = fine.width / kSamples, height = fine.height / kSamples;
  Sums sums(3 * TexelIndex(0, height, width), 0);
  for (int y = 0; y < kSamples * height; ++y) {
    for (int x = 0; x < kSamples * width; ++x) {
      const std::uint8_t* rgb = &fine.rgb[3 * TexelIndex(x, y, fine.width)];
      std::uint16_t* sum = &sums[3 * TexelIndex(x / kSamples, y / kSamples, width)];
      for (int c = 0; c < 3; ++c) sum[c] = static_cast<std::uint16_t>(sum[c] + rgb[c]);
    }
  }
  return sums;
}

Bitmap MeanOf(const Sums& sums, int width, int height) {
  Bitmap mean{width, height, std::vector<std::uint8_t>(sums.size())};
  for (std::size_t i = 0; i < sums.size(); ++i) {
    mean.rgb[i] = static_cast<std::uint8_t>((sums[i] + kSamples * kSamples / 2) / (kSamples * kSamples));
  }
  return mean;
}

/// Draws `count` pictures of the moment from a creeping scope, `size` times as large, and gives each to `take`.
template <class Take>
void DrawCreeping(const SceneView& scene, const SyntheticMoment& moment, int count, int size, float scale, bool smooth,
                  const Take& take) {
  SampledView sampled(scene, moment, size, scale);
  sampled.laparoscope.SetSmoothEdges(smooth);
  const RenderParams& start = scene.render;
  const Mat3f axes = MakeLaparoscope(start).view.block<3, 3>(0, 0);  // Rows: the picture's axes in frame W.
  const float distance = (start.scope_target_W - start.scope_tip_W).norm();
  const float pixel_m = 2 * distance * std::tan(0.5f * RadiansOf(start.fov_deg)) / static_cast<float>(start.height);
  const Vec3f step = kCreep * pixel_m * (axes.transpose() * Vec3f(kDirection.x(), kDirection.y(), 0));
  for (int k = 0; k < count; ++k) {
    RenderParams camera = start;
    camera.scope_tip_W += static_cast<float>(k) * step;
    camera.scope_target_W += static_cast<float>(k) * step;
    sampled.laparoscope.SetCamera(camera);
    sampled.laparoscope.Update();
    Bitmap picture;
    sampled.display->DrawAndRead(&picture);
    take(k, picture);
  }
}

}  // namespace

void Flicker(const SceneView& scene, benchmark::Report* report) {
  if (!report->Wants("render.temporal_flicker")) return;
  const SyntheticMoment moment = MakeSyntheticMoment(scene, 12.0);
  const int count = report->quick() ? 5 : 25;
  const int width = static_cast<int>(scene.render.width), height = static_cast<int>(scene.render.height);
  std::vector<Sums> reference;
  DrawCreeping(scene, moment, count, kSamples, 1, false,
               [&](int, const Bitmap& fine) { reference.push_back(SumsOf(fine)); });
  std::vector<std::vector<std::size_t>> edges;
  for (const Sums& sums : reference) edges.push_back(EdgePixels(MeanOf(sums, width, height)));
  // Mean of f(k, i) over the channels i of the edges of all pictures but the last.
  const auto mean = [&](const auto& f) {
    double sum = 0, n = 0;
    for (std::size_t k = 0; k + 1 < reference.size(); ++k) {
      for (const std::size_t pixel : edges[k]) {
        for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) sum += std::abs(f(k, i));
      }
      n += 3 * static_cast<double>(edges[k].size());
    }
    return n > 0 ? sum / n : std::nan("");
  };
  const auto change = [&](std::size_t k, std::size_t i) {
    return (int{reference[k + 1][i]} - int{reference[k][i]}) / static_cast<double>(kSamples * kSamples);
  };
  report->Add("render.temporal_flicker.ideal_change", mean(change), "1/255");
  for (const auto& [name, scale] : kSampledScales) {
    for (const bool smooth : {false, true}) {
      std::vector<Bitmap> pictures;
      DrawCreeping(scene, moment, count, 1, scale, smooth,
                   [&](int, const Bitmap& picture) { pictures.push_back(picture); });
      report->Add(std::string("render.temporal_flicker.") + (smooth ? "" : "plain_") + name,
                  mean([&](std::size_t k, std::size_t i) {
                    return int{pictures[k + 1].rgb[i]} - int{pictures[k].rgb[i]} - change(k, i);
                  }),
                  "1/255");
    }
  }
}

}  // namespace fulcrum::render
