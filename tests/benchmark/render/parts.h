// Parts of bench_render, each with its own keys.
#pragma once

#include <ctime>
#include <memory>
#include <utility>
#include <vector>

#include "render_node/scene_graph/display.h"
#include "render_node/scene_graph/laparoscope_view.h"
#include "tests/benchmark/report.h"
#include "tests/integration/render/synthetic_scene.h"

namespace fulcrum::render {

/// Gives the view all of a moment but its handles.
void Show(const SyntheticMoment& moment, LaparoscopeView* view);

/// A view of a moment, off screen: a picture with `size` times the scene's width and height, drawn at `scale`.
struct SampledView {
  SampledView(const SceneView& scene, const SyntheticMoment& moment, int size, float scale);
  SceneView view;
  LaparoscopeView laparoscope;
  std::unique_ptr<Display> display;
};

/// Mean over blocks of n x n pixels.
[[nodiscard]] Bitmap Mean(const Bitmap& fine, int n);
/// Mean difference of the channels of some pixels [of 255].
[[nodiscard]] double MeanDifference(const Bitmap& a, const Bitmap& b, const std::vector<std::size_t>& pixels);

/// Time of a clock [ms].
[[nodiscard]] double CpuMs(clockid_t clock);
/// Moves the tissue slightly, so that no two pictures are equal.
void Sway(const std::vector<float>& rest, int step, std::vector<float>* xyz);

/// The qualities whose pictures are compared with many samples a pixel, by scale.
constexpr std::pair<const char*, float> kSampledScales[] = {
    {"low", 0.52f}, {"high", 1.0f}, {"smooth2", 2.0f}, {"smooth4", 4.0f}};

/// render.look.*: pictures of several scenes beside published figures of endoscopic pictures. Prints the comparison as
/// a table in lines `# |`.
void LookFigures(const SceneView& built_in, benchmark::Report* report);

/// render.cut.*: cost of the lips and strands of a whole cut.
void CutFigures(const SceneView& scene, benchmark::Report* report);

/// render.edge_error.*, render.smooth_edges.*: edges against many samples a pixel, and what smoothing them costs.
void Edges(const SceneView& scene, benchmark::Report* report);
/// render.temporal_flicker.*: edges while the scope creeps.
void Flicker(const SceneView& scene, benchmark::Report* report);

/// render.smoothing.*: edges that rest, edges while the hook moves, and what remains of a moved hook.
void Smoothing(const SceneView& scene, benchmark::Report* report);

}  // namespace fulcrum::render
