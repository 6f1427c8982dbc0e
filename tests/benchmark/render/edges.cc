// Mean difference of edge pixels (EdgePixels) from a picture of four by four samples a pixel [of 255], as the node
// draws and, `plain_`, without the smoothing of edges (scene_graph/edge_lines.h); and the processor time of a picture
// of both, all threads, drawn in turns while everything moves.
#include <ctime>
#include <string>
#include <vector>

#include "tests/benchmark/render/parts.h"
#include "tests/support/picture_statistics.h"

namespace fulcrum::render {
namespace {

constexpr int kFinest = 4;  // Samples of the reference, in each direction.

Bitmap DrawOnce(const SceneView& scene, const SyntheticMoment& moment, int size, float scale, bool smooth) {
  SampledView sampled(scene, moment, size, scale);
  sampled.laparoscope.SetSmoothEdges(smooth);
  sampled.laparoscope.Update();
  Bitmap picture;
  sampled.display->DrawAndRead(&picture);
  return picture;
}

void EdgeErrors(const SceneView& scene, benchmark::Report* report) {
  const SyntheticMoment moment = MakeSyntheticMoment(scene, 12.0);
  const Bitmap reference = Mean(DrawOnce(scene, moment, kFinest, 1, false), kFinest);
  const std::vector<std::size_t> edges = EdgePixels(reference);
  for (const auto& [name, scale] : kSampledScales) {
    for (const bool smooth : {false, true}) {
      report->Add(std::string("render.edge_error.") + (smooth ? "" : "plain_") + name,
                  MeanDifference(DrawOnce(scene, moment, 1, scale, smooth), reference, edges), "1/255");
    }
  }
}

void EdgeCost(const SceneView& scene, benchmark::Report* report) {
  const SyntheticMoment moment = MakeSyntheticMoment(scene, 12.0);
  const int repeats = report->quick() ? 20 : 60, settling = 3;
  for (const auto& [name, scale] : kSampledScales) {
    if (scale > 1) continue;
    SampledView plain(scene, moment, 1, scale), smooth(scene, moment, 1, scale);
    smooth.laparoscope.SetSmoothEdges(true);
    double plain_ms = 0, smooth_ms = 0;
    std::vector<float> xyz;
    SyntheticMoment moved = moment;
    for (int k = 0; k < settling + repeats; ++k) {
      Sway(moment.tissue.xyz, k, &xyz);
      for (ToolSample& tool : moved.tools.tools) tool.p_WT.z() += 1e-5f;
      for (SampledView* each : {&plain, &smooth}) {
        const double before_ms = CpuMs(CLOCK_PROCESS_CPUTIME_ID);
        each->laparoscope.SetTissue(xyz);
        for (int tool = 0; tool < kMaxTools; ++tool) {
          each->laparoscope.SetTool(tool, moved.tools.tools[static_cast<std::size_t>(tool)]);
        }
        each->laparoscope.Update();
        each->display->Draw();
        if (k >= settling) (each == &plain ? plain_ms : smooth_ms) += CpuMs(CLOCK_PROCESS_CPUTIME_ID) - before_ms;
      }
    }
    const std::string prefix = std::string("render.smooth_edges.") + name;
    report->Add(prefix + "_plain_cpu_ms", plain_ms / repeats, "ms");
    report->Add(prefix + "_cpu_ms", smooth_ms / repeats, "ms");
    report->Add(prefix + "_cost_pct", 100 * (smooth_ms / plain_ms - 1), "%");
  }
}

}  // namespace

void Edges(const SceneView& scene, benchmark::Report* report) {
  if (report->Wants("render.edge_error")) EdgeErrors(scene, report);
  if (report->Wants("render.smooth_edges")) EdgeCost(scene, report);
}

}  // namespace fulcrum::render
