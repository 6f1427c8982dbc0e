// Figures of the pictures beside published figures of endoscopic and natural pictures. Nothing passes or fails by them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "render_node/scene_graph/display.h"
#include "services/scene/compiler/compile.h"
#include "tests/benchmark/render/parts.h"
#include "tests/support/picture_statistics.h"
#include "tests/support/whole_topology.h"

namespace fulcrum::render {
namespace {

struct LookedAt {
  const char* name;
  const char* scene;                                       // "built-in", or a file of deploy/scenes, at rest.
  double time_s = 0;                                       // Of the script of built-in.
  Vec3f target_m = Vec3f::Zero(), from_m = Vec3f::Zero();  // Frame W; scope relative to the target. Zero: the scene's.
  float fov_deg = 60;
};

// Places as in tests/integration/render/reference_views.cc.
const std::vector<LookedAt> kLookedAt{
    {"rest", "built-in", 0.5},
    {"tent", "built-in", 6.5},
    {"mid_cut", "built-in", 12.0},
    {"slit_above", "built-in", 17.5, {0.004f, -0.001f, 0.018f}, {0.000f, -0.022f, 0.070f}, 26},
    {"slit_along", "built-in", 14.0, {0.004f, -0.004f, 0.019f}, {0.002f, -0.060f, 0.022f}, 20},
    {"beneath", "built-in", 12.0, {-0.004f, -0.004f, 0.020f}, {0.030f, -0.060f, 0.026f}, 32},
    {"instruments", "built-in", 11.0, {-0.004f, -0.002f, 0.028f}, {0.010f, -0.060f, 0.050f}, 30},
    {"gallbladder", "gallbladder"},
    {"adhesions", "adhesions"},
};

/// A figure that is printed, and what is published of it.
struct Figure {
  const char* key;
  const char* unit;
  const char* text;
  double low, high;  // Published; nan: none found.
  const char* published;
  const char* source;
};

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// Sources: deploy/docs/measurements/picture/look.md.
const std::vector<Figure> kFigures{
    {"red_mean", "1/255", "mean red", 106, 120, "106, 119", "Cholec80; EndoVis 2018"},
    {"green_mean", "1/255", "mean green", 66, 89, "67, 89", "Cholec80; EndoVis 2018"},
    {"blue_mean", "1/255", "mean blue", 66, 94, "66, 94", "Cholec80; EndoVis 2018"},
    {"red_to_green", "1", "mean red / mean green", 1.34, 1.60, "1.60, 1.34", "Cholec80; EndoVis 2018"},
    {"red_to_blue", "1", "mean red / mean blue", 1.27, 1.61, "1.61, 1.27", "Cholec80; EndoVis 2018"},
    {"hue_deg", "deg", "hue of the mean colour", -10.6, 0.8, "0.8, -10.6", "Cholec80; EndoVis 2018"},
    {"saturation", "1", "saturation of the mean colour", 0.26, 0.38, "0.38, 0.26", "Cholec80; EndoVis 2018"},
    {"red_deviation", "1/255", "standard deviation of red", 51, 56, "56, 52", "Cholec80; EndoVis 2018"},
    {"red_p05", "1/255", "red, 5 % quantile", kNone, kNone, "none found", ""},
    {"red_p95", "1/255", "red, 95 % quantile", kNone, kNone, "none found", ""},
    {"hue_p05", "deg", "hue of the pixels, 5 % quantile", kNone, kNone, "none found", ""},
    {"hue_p95", "deg", "hue of the pixels, 95 % quantile", kNone, kNone, "none found", ""},
    {"saturation_p05", "1", "saturation of the pixels, 5 % quantile", kNone, kNone, "none found", ""},
    {"saturation_p95", "1", "saturation of the pixels, 95 % quantile", kNone, kNone, "none found", ""},
    {"red_most_pct", "%", "pixels with no channel above red", 50, 100, "most outside highlights", "Yu 2021"},
    {"specular_pct", "%", "specular pixels", 0.4, 0.9, "0.4 to 0.9", "from Akbari 2018, Yu 2021"},
    {"near_white_pct", "%", "of these near white", kNone, kNone, "none found", ""},
    {"specular_spots", "1", "specular spots", kNone, kNone, "none found", ""},
    {"spot_area_p50", "px", "area of a spot, median", kNone, kNone, "none found", ""},
    {"spot_area_p90", "px", "area of a spot, 90 %", kNone, kNone, "none found", ""},
    {"spectrum_slope", "1", "slope of the amplitude spectrum", -1.6, -0.8, "-1.59; -0.8 to -1.5",
     "surgical photographs; natural scenes"},
    {"border_to_centre", "1", "grey at the border / in the middle", kNone, kNone, "below 0.22, 0.43 on a flat grid",
     "Abel 2021, 30 and 0 degrees"},
    {"edge_pct", "%", "edge pixels", kNone, kNone, "none found", ""},
    {"edge_width_px", "px", "10-90 % width of an edge, median", kNone, kNone, "none found", ""},
};

using Figures = std::map<std::string, double>;

Figures Measure(const Bitmap& picture, const RoundField& field) {
  const ColourStatistics colour = MeasureColour(picture, field);
  const SpecularStatistics specular = MeasureSpecular(picture, field);
  const EdgeStatistics edges = MeasureEdges(picture, field);
  const SpectrumStatistics spectrum = MeasureSpectrum(picture, field);
  double squares = 0;
  const auto pixels = PixelsIn(picture, field);
  for (const std::size_t pixel : pixels) squares += std::pow(picture.rgb[3 * pixel] - colour.rgb[0].mean, 2);
  return {{"red_mean", colour.rgb[0].mean},
          {"green_mean", colour.rgb[1].mean},
          {"blue_mean", colour.rgb[2].mean},
          {"red_to_green", colour.red_to_green},
          {"red_to_blue", colour.red_to_blue},
          {"hue_deg", colour.mean_colour.hue_deg},
          {"saturation", colour.mean_colour.saturation},
          {"red_deviation", std::sqrt(squares / static_cast<double>(pixels.size()))},
          {"red_p05", colour.rgb[0].p05},
          {"red_p95", colour.rgb[0].p95},
          {"hue_p05", colour.hue_deg.p05},
          {"hue_p95", colour.hue_deg.p95},
          {"saturation_p05", colour.saturation.p05},
          {"saturation_p95", colour.saturation.p95},
          {"red_most_pct", 100 * colour.red_most},
          {"specular_pct", 100 * specular.share},
          {"near_white_pct", 100 * specular.near_white},
          {"specular_spots", static_cast<double>(specular.spots)},
          {"spot_area_p50", specular.area_p50},
          {"spot_area_p90", specular.area_p90},
          {"spectrum_slope", spectrum.slope},
          {"border_to_centre", colour.border_to_centre},
          {"edge_pct", 100 * edges.share},
          {"edge_width_px", edges.width_p50}};
}

/// A scene without motion, cuts and tools.
SyntheticMoment AtRest(const SceneView& scene) {
  SyntheticMoment moment;
  moment.tissue.header.scene_hash = scene.hash;
  moment.tissue.header.vertex_count = static_cast<std::uint32_t>(scene.rest_position.size());
  for (const Vec3f& p : scene.rest_position) moment.tissue.xyz.insert(moment.tissue.xyz.end(), p.begin(), p.end());
  moment.topology = WholeTopology(scene);
  return moment;
}

Figures Draw(SceneView scene, const LookedAt& view, const SyntheticMoment& moment) {
  if (view.from_m != Vec3f::Zero()) {
    scene.render.scope_target_W = view.target_m;
    scene.render.scope_tip_W = view.target_m + view.from_m;
    scene.render.fov_deg = view.fov_deg;
  }
  LaparoscopeView laparoscope(scene);
  const auto display = MakeOffscreenDisplay(laparoscope, scene.render);
  Show(moment, &laparoscope);
  laparoscope.Update();
  Bitmap picture;
  display->DrawAndRead(&picture);
  constexpr float kRim = 0.98f;  // Of the radius: without the border of the mask.
  const Laparoscope optics = MakeLaparoscope(scene.render);
  const Figures figures = Measure(picture, {optics.picture_centre, kRim * optics.circle_radius});
  if (figures.at("red_mean") < 1 || figures.at("red_deviation") < 1) {
    throw std::runtime_error(std::string("render.look: the picture of ") + view.name + " is empty");
  }
  return figures;
}

const char* Verdict(const Figure& figure, double value) {
  if (std::isnan(figure.low)) return "not compared";
  if (value < figure.low) return "below";
  return value > figure.high ? "above" : "within";
}

std::string Rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, std::abs(value) < 10 ? "%.2f" : "%.0f", value);
  return text;
}

}  // namespace

void LookFigures(const SceneView& built_in, benchmark::Report* report) {
  if (!report->Wants("render.look.")) return;
  std::map<std::string, std::vector<double>> all;
  for (const LookedAt& view : kLookedAt) {
    Figures figures;
    if (std::string(view.scene) == "built-in") {
      figures = Draw(built_in, view, MakeSyntheticMoment(built_in, view.time_s));
    } else {
      const auto file =
          std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/scenes" / (view.scene + std::string(".yaml"));
      const scene::SceneData data = scene::CompileScene(file, {}, {}).data;
      const SceneView scene = data.View();
      figures = Draw(scene, view, AtRest(scene));
    }
    for (const Figure& figure : kFigures) {
      const double value = figures.at(figure.key);
      all[figure.key].push_back(value);
      report->Add(std::string("render.look.") + view.name + '.' + figure.key, value, figure.unit);
    }
  }
  std::map<std::string, double> means;
  for (const auto& [key, values] : all) {
    double sum = 0;
    for (const double value : values) sum += value;
    means[key] = sum / static_cast<double>(values.size());
  }
  for (const Figure& figure : kFigures) {
    report->Add(std::string("render.look.mean.") + figure.key, means[figure.key], figure.unit);
  }
  std::printf("# | figure | mean | least to most | published | verdict | source |\n# |---|---|---|---|---|---|---|\n");
  for (const Figure& figure : kFigures) {
    const auto [least, most] = std::ranges::minmax(all[figure.key]);
    const std::string unit = std::string(figure.unit) == "1" ? "" : std::string(" [") + figure.unit + ']';
    std::printf("# | %s%s | %s | %s to %s | %s | %s | %s |\n", figure.text, unit.c_str(),
                Rounded(means[figure.key]).c_str(), Rounded(least).c_str(), Rounded(most).c_str(), figure.published,
                Verdict(figure, means[figure.key]), figure.source);
  }
}

}  // namespace fulcrum::render
