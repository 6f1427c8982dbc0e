#include "tests/benchmark/thermal/paper_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/benchmark/thermal/picture.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "thermal_node/paper/paper_model.h"

namespace fulcrum::thermal {
namespace {

using benchmark::Report;

constexpr float kDt = 0.01f, kSpacing_m = 1e-3f;
constexpr std::uint32_t kRows = 41, kCols = 61;

struct CutFigures {
  double frame_ms_p50 = 0, frame_ms_p99 = 0;
  double watt = 0;       ///< Power of the generator, mean.
  double J_per_mm3 = 0;  ///< Energy put into the sheet per volume removed.
  double width_mm = 0;   ///< Width of the slit, mean.
  double length_mm = 0;
  double highest_C = 0;
};

/// The same cut of 30 mm at 5 mm/s, along the middle between two rows of the mesh, by either model.
CutFigures Cut(ThermalModel model, const char* name) {
  scene::SceneData data = FlatScene(kRows, kCols, kSpacing_m);
  data.fixed.thermal.model = model;
  const SceneView scene = data.View();
  ThermalSolver solver(scene);
  Drag drag;
  drag.from = {0.01503f, 0.02047f};
  drag.to = {0.04503f, 0.02047f};
  std::vector<double> times;
  for (int frame = 0; frame < drag.frames(kDt); ++frame) {
    const auto step = [&] { solver.Step(drag.At(frame, kDt), kDt); };
    times.push_back(benchmark::TimeMs(0, 1, step).front());
  }
  const char* folder = std::getenv("FULCRUM_PICTURES");
  if (folder != nullptr) {
    const std::filesystem::path file = std::filesystem::path(folder) / (std::string("model_") + name + ".png");
    WritePicture(solver, scene, drag.to, 0.016f, file);
  }
  for (int n = 0; n < kCommitFrames; ++n) solver.Step(TipInput{}, kDt);
  double removed_m3 = 0;
  for (const Tile* tile : solver.field().Existing()) {
    for (int k = 0; k < kTileCells; ++k) removed_m3 += (tile->state.flags[k] & kRemoved) != 0 ? tile->Volume(k) : 0.0;
  }
  return {.frame_ms_p50 = benchmark::Quantile(times, 0.5),
          .frame_ms_p99 = benchmark::Quantile(times, 0.99),
          .watt = solver.ledger().generator / (drag.frames(kDt) * kDt),
          .J_per_mm3 = solver.ledger().joule / (1e9 * removed_m3),
          .width_mm = 1e3 * MeasureSlit(solver, scene, drag).width_mean_m,
          .length_mm = 1e3 * solver.cut_length_m(),
          .highest_C = solver.figures().highest_C};
}

void Cuts(Report* report) {
  if (!report->Wants("thermal.paper.cut")) return;
  for (const auto& [model, name] :
       {std::pair{ThermalModel::kPaper, "paper"}, std::pair{ThermalModel::kAccurate, "accurate"}}) {
    const CutFigures f = Cut(model, name);
    const std::string stem = std::string("thermal.paper.cut.") + name + ".";
    report->Add(stem + "frame_ms_p50", f.frame_ms_p50, "ms");
    report->Add(stem + "frame_ms_p99", f.frame_ms_p99, "ms");
    report->Add(stem + "power_W", f.watt, "W");
    report->Add(stem + "J_per_mm3", f.J_per_mm3, "J/mm3");
    report->Add(stem + "width_mm", f.width_mm, "mm");
    report->Add(stem + "length_mm", f.length_mm, "mm");
    report->Add(stem + "highest_C", f.highest_C, "C");
  }
}

/// Heat at which a cell is removed, without conduction: to 100 C, and at 100 C all its water.
void RemovalEnergy(Report* report) {
  if (!report->Wants("thermal.paper.removal")) return;
  const ThermalParams params;
  const Material accurate = MakeMaterial(params), paper = MakePaperMaterial(params);
  const double paper_J = paper.rc_wet * (kBoiling_C - paper.body_C);
  const double accurate_J = accurate.BoilingEnthalpy(1.0f) + accurate.latent;
  report->Add("thermal.paper.removal.J_per_mm3", 1e-9 * paper_J, "J/mm3");
  report->Add("thermal.paper.removal.accurate_J_per_mm3", 1e-9 * accurate_J, "J/mm3");
  report->Add("thermal.paper.removal.too_early", accurate_J / paper_J, "1");
}

void Sweeps(Report* report) {
  if (!report->Wants("thermal.paper.potential")) return;
  TexturePotential potential;
  for (int j = 0; j < kTexture; ++j) std::ranges::fill(potential.tissue_row(j), 1.0f);
  const auto solve = [&] {
    for (int j = -5; j <= 5; ++j) {
      for (int i = -5; i <= 5; ++i) {
        if (i * i + j * j <= 25) potential.SetElectrode(kTexture / 2 + i, kTexture / 2 + j);
      }
    }
    potential.Relax(kPaperSweeps);
    return potential.TakeConductance();
  };
  const float first = solve();
  report->Add("thermal.paper.potential.ms", benchmark::Quantile(benchmark::TimeMs(2, 15, solve), 0.5), "ms");
  report->Add("thermal.paper.potential.sweeps", kPaperSweeps, "1");
  // Error of the sweeps of a frame: the electrode's current at touch-down and a second later.
  for (int n = 0; n < 80; ++n) (void)solve();
  const float second = solve();
  for (int n = 0; n < 6000; ++n) (void)solve();
  const float converged = solve();
  report->Add("thermal.paper.potential.first_frame_error_pct", 100 * std::abs(first / converged - 1), "%");
  report->Add("thermal.paper.potential.second_error_pct", 100 * std::abs(second / converged - 1), "%");
}

/// A straight slit: `width_m` of vaporised tissue around the line through `at`, 20 mm long.
struct Slit {
  Vec2f at, along;
  [[nodiscard]] Vec2f End(float side) const { return at + side * 0.010f * along; }
  [[nodiscard]] bool Holds(const Vec2f& p, float width_m) const {
    const Vec2f d = p - at;
    return std::abs(d.dot(along)) <= 0.010f && std::abs(d.x() * along.y() - d.y() * along.x()) <= 0.5f * width_m;
  }
};

float Side(const Vec2f& a, const Vec2f& b, const Vec2f& p) {
  return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
}

/// Edges that cross the slit, and those of them that each rule leaves alive.
struct Crossings {
  int all = 0, paper = 0, accurate = 0;
};

Crossings Cross(const SceneView& scene, const Slit& slit, float width_m) {
  const Material material = MakePaperMaterial(scene.thermal);
  HeatField hot(MakeSheet(scene), material), holed(MakeSheet(scene), material);
  MeshTopology by_node(scene, hot.sheet()), by_path(scene, hot.sheet());
  PaperModel model(scene, hot.sheet());
  Ledger ledger;
  for (int iy = 0; iy < hot.sheet().ny; ++iy) {
    for (int ix = 0; ix < hot.sheet().nx; ++ix) {
      if (!slit.Holds(hot.sheet().CentreOf({ix, iy}), width_m)) continue;
      const int cell = (iy % kTile) * kTile + ix % kTile;
      hot.Wake(ix / kTile, iy / kTile)->state.enthalpy[cell] = 70.0f * material.rc_wet;
      holed.TakeOut(holed.Wake(ix / kTile, iy / kTile), cell, kRemoved, &ledger.removed);
    }
  }
  for (Tile* tile : hot.awake()) hot.RefreshTheta(tile, &ledger);
  (void)model.RemoveNodes(&hot, &by_node, &ledger);
  by_path.StageCut(holed, {0, 0}, {holed.sheet().nx - 1, holed.sheet().ny - 1});
  by_node.Commit();
  by_path.Commit();
  Crossings count;
  // A millimetre from its ends, because near them the slit itself ends within an edge.
  const Vec2f c = slit.End(-0.9f), d = slit.End(0.9f);
  for (std::size_t e = 0; e < scene.membrane_rest_length.size(); ++e) {
    if (scene.membrane_rest_length[e] <= 0) continue;
    const Vec2f a = scene.membrane_material[e / 3];
    const Vec2f b = scene.membrane_material[e / 3 + std::array<std::size_t, 3>{1, kCols, kCols + 1}[e % 3]];
    if (Side(a, b, c) * Side(a, b, d) >= 0 || Side(c, d, a) * Side(c, d, b) >= 0) continue;
    ++count.all;
    count.paper += TestBit(by_node.committed().dead_edges, e) ? 0 : 1;
    count.accurate += TestBit(by_path.committed().dead_edges, e) ? 0 : 1;
  }
  return count;
}

/// 200 slits of 0.45 mm on a mesh of 1 mm, along its rows and in any direction.
void Slits(Report* report) {
  if (!report->Wants("thermal.paper.slit")) return;
  const scene::SceneData data = FlatScene(kRows, kCols, kSpacing_m);
  const SceneView scene = data.View();
  constexpr float kWidth_m = 4.5e-4f;
  const int lines = report->quick() ? 20 : 200;
  for (const bool any_way : {false, true}) {
    std::minstd_rand random(1);
    const auto uniform = [&](double low, double high) {
      return static_cast<float>(low + (high - low) * (random() - 1.0) / 2147483646.0);
    };
    Crossings sum;
    for (int n = 0; n < lines; ++n) {
      const float angle = any_way ? uniform(0, std::numbers::pi) : 0.0f;
      const float x = uniform(0.025, 0.035), y = uniform(0.018, 0.022);
      const Crossings one = Cross(scene, {{x, y}, {std::cos(angle), std::sin(angle)}}, kWidth_m);
      sum = {sum.all + one.all, sum.paper + one.paper, sum.accurate + one.accurate};
    }
    const std::string stem = std::string("thermal.paper.slit.") + (any_way ? "any_way." : "along_rows.");
    report->Add(stem + "missed_pct", 100.0 * sum.paper / sum.all, "%");
    report->Add(stem + "accurate_missed_pct", 100.0 * sum.accurate / sum.all, "%");
  }
}

}  // namespace

void PaperCases(Report* report) {
  Cuts(report);
  RemovalEnergy(report);
  Sweeps(report);
  Slits(report);
}

}  // namespace fulcrum::thermal
