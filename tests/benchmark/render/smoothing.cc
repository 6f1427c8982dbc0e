// What the last pictures of a resting scope make of edges (geometry/temporal_filter.h), against pictures of four by
// four samples a pixel, [of 255]:
//   rest    mean difference of edge pixels (EdgePixels of the reference) when nothing has moved for long enough
//   moving  the same while the hook moves by 0.5 pixels a picture, and of those pixels alone that it changes in the
//           reference from one picture to the next: a ghost would be seen there
// `.triangles` is the difference of the reference drawn with the triangles of a picture of its size: no sampling of
// those triangles can come below it.
#include <cmath>
#include <string>
#include <vector>

#include "tests/benchmark/render/parts.h"
#include "tests/support/picture_statistics.h"

namespace fulcrum::render {
namespace {

constexpr int kFineSamples = 4;      // Of the reference, in each direction.
constexpr int kLeastChange = 6;      // [of 255] of a channel, from which on a pixel counts as changed.
constexpr int kMovingPictures = 9;   // Compared, of a moving hook.
constexpr int kPicturesBefore = 40;  // Drawn before, as long as the longest period of the jitter here.
constexpr double kPictureRate_Hz = 30;
constexpr std::pair<const char*, float> kSmoothedScales[] = {
    {"052", 0.52f}, {"072", 0.72f}, {"085", 0.85f}, {"100", 1.0f}};

Bitmap DrawNow(SampledView* sampled) {
  sampled->laparoscope.Update();
  Bitmap picture;
  sampled->display->DrawAndRead(&picture);
  return picture;
}

/// The last kMovingPictures of a session in which the hook moves.
std::vector<Bitmap> DrawMoving(const SceneView& scene, int size, float scale, bool smoothed) {
  const auto moment = [&](int k) { return MakeSyntheticMoment(scene, 12.0 + k / kPictureRate_Hz); };
  const int first = smoothed ? -kPicturesBefore : 0;
  SampledView sampled(scene, moment(first), size, scale);
  sampled.laparoscope.SetSmoothed(smoothed);
  std::vector<Bitmap> pictures;
  for (int k = first; k < kMovingPictures; ++k) {
    Show(moment(k), &sampled.laparoscope);
    const Bitmap picture = DrawNow(&sampled);
    if (k >= 0) pictures.push_back(size > 1 ? Mean(picture, size) : picture);
  }
  return pictures;
}

std::vector<std::size_t> ChangedPixels(const Bitmap& a, const Bitmap& b) {
  std::vector<std::size_t> changed;
  for (std::size_t pixel = 0; 3 * pixel < a.rgb.size(); ++pixel) {
    int most = 0;
    for (std::size_t k = 3 * pixel; k < 3 * pixel + 3; ++k)
      most = std::max(most, std::abs(int{a.rgb[k]} - int{b.rgb[k]}));
    if (most > kLeastChange) changed.push_back(pixel);
  }
  return changed;
}

void ErrorAtRest(const SceneView& scene, benchmark::Report* report) {
  const SyntheticMoment moment = MakeSyntheticMoment(scene, 12.0);
  SampledView fine(scene, moment, kFineSamples, 1);
  const Bitmap reference = Mean(DrawNow(&fine), kFineSamples);
  fine.laparoscope.SetDetail(1.0f / kFineSamples);
  Show(moment, &fine.laparoscope);
  const Bitmap same_triangles = Mean(DrawNow(&fine), kFineSamples);
  const std::vector<std::size_t> edges = EdgePixels(reference);
  const std::string prefix = "render.smoothing.rest_error.";
  report->Add(prefix + "triangles", MeanDifference(same_triangles, reference, edges), "1/255");
  for (const auto& [name, scale] : kSmoothedScales) {
    SampledView sampled(scene, moment, 1, scale);
    report->Add(prefix + "single_" + name, MeanDifference(DrawNow(&sampled), reference, edges), "1/255");
    sampled.laparoscope.SetSmoothed(true);
    Bitmap picture = DrawNow(&sampled);
    while (sampled.laparoscope.Refine()) picture = DrawNow(&sampled);
    report->Add(prefix + "smoothed_" + name, MeanDifference(picture, reference, edges), "1/255");
    report->Add(prefix + "smoothed_" + name + "_same_triangles", MeanDifference(picture, same_triangles, edges),
                "1/255");
  }
}

void ErrorInMotion(const SceneView& scene, benchmark::Report* report) {
  const std::vector<Bitmap> reference = DrawMoving(scene, kFineSamples, 1, false);
  for (const auto& [name, scale] : kSmoothedScales) {
    for (const bool smoothed : {false, true}) {
      const std::vector<Bitmap> pictures = DrawMoving(scene, 1, scale, smoothed);
      double edges = 0, changed = 0;
      for (std::size_t k = 1; k < reference.size(); ++k) {
        edges += MeanDifference(pictures[k], reference[k], EdgePixels(reference[k])) / (kMovingPictures - 1);
        changed += MeanDifference(pictures[k], reference[k], ChangedPixels(reference[k], reference[k - 1])) /
                   (kMovingPictures - 1);
      }
      const std::string which = std::string(smoothed ? "smoothed_" : "single_") + name;
      report->Add("render.smoothing.moving_error." + which, edges, "1/255");
      report->Add("render.smoothing.moved_error." + which, changed, "1/255");
    }
  }
}

}  // namespace

void Smoothing(const SceneView& scene, benchmark::Report* report) {
  if (report->Wants("render.smoothing.rest_error.")) ErrorAtRest(scene, report);
  if (report->Wants("render.smoothing.mov")) ErrorInMotion(scene, report);
}

}  // namespace fulcrum::render
