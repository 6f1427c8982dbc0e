#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/benchmark/thermal/thermal_cases.h"
#include "tests/numerics/thermal/heat_cases.h"
#include "tests/numerics/thermal/moving_gaussian.h"
#include "tests/numerics/thermal/potential_rings.h"

namespace fulcrum::thermal {
namespace {

using benchmark::Quantile;
using benchmark::Report;
using benchmark::TimeMs;

void HeatOneSpot(Report* report) {
  if (!report->Wants("thermal.heat_one_spot")) return;
  const MovingGaussianResult result = RunMovingGaussian(1e-4f);
  report->Add("thermal.heat_one_spot.step_ms", result.step_ms, "ms");
  report->Add("thermal.heat_one_spot.max_error_pct", 100 * result.max_error, "%");
}

void HeatFastTip(Report* report) {
  if (!report->Wants("thermal.heat_fast_tip")) return;
  const MovingGaussianResult result = RunMovingGaussian(1e-4f, 0.05);
  report->Add("thermal.heat_fast_tip.step_ms", result.step_ms, "ms");
  report->Add("thermal.heat_fast_tip.max_error_pct", 100 * result.max_error, "%");
}

/// Heats the tiles around `tip` like a Gaussian source that passes in one frame, by about 5 K in its middle.
void AddSpot(HeatField* field, const Vec2f& tip) {
  constexpr float kWidth_m = 2.5e-4f, kPeak_K = 5, kReach_m = 5 * kWidth_m;
  const float cell = field->material().cell_m, tile_m = kTile * cell;
  const auto tile_of = [&](float x) { return static_cast<int>(x / tile_m); };
  Ledger ledger;
  for (int ty = tile_of(tip.y() - kReach_m); ty <= tile_of(tip.y() + kReach_m); ++ty) {
    for (int tx = tile_of(tip.x() - kReach_m); tx <= tile_of(tip.x() + kReach_m); ++tx) {
      Tile* tile = field->Wake(tx, ty);
      for (int k = 0; k < kTileCells; ++k) {
        const Vec2f away = field->sheet().CentreOf({tx * kTile + k % kTile, ty * kTile + k / kTile}) - tip;
        const float rise = kPeak_K * std::exp(-0.5f * away.squaredNorm() / (kWidth_m * kWidth_m));
        tile->state.enthalpy[k] += rise * field->material().rc_wet;
      }
      field->RefreshTheta(tile, &ledger);
    }
  }
}

/// Eight Gaussians at once, each 4 mm along its own row of one sheet at 10 mm/s: the step of conduction alone.
void EightSpots(Report* report) {
  if (!report->Wants("thermal.eight_spots")) return;
  HeatField field(MakeFlatSheet(76.8e-3f, 25.6e-3f, 1e-4f), MakeMaterial(ThermalParams{}));
  Ledger ledger;
  std::vector<double> times;
  for (int frame = 0; frame < 40; ++frame) {
    const float way = 0.010f * kFrame_s * static_cast<float>(frame);
    for (int spot = 0; spot < 8; ++spot) {
      const Vec2f start(6.4e-3f + 19.2e-3f * static_cast<float>(spot % 4), spot < 4 ? 6.4e-3f : 19.2e-3f);
      AddSpot(&field, start + Vec2f(way, 0.3f * way));
    }
    times.push_back(TimeMs(0, 1, [&] { field.Diffuse(kFrame_s, &ledger); }).front());
  }
  report->Add("thermal.eight_spots.step_ms", Quantile(times, 0.5), "ms");
  report->Add("thermal.eight_spots.tiles", static_cast<double>(field.awake().size()), "1");
}

/// Cells half as large with steps a quarter as long, and steps halved on one grid.
void Orders(Report* report) {
  if (!report->Wants("thermal.order")) return;
  const double mode = std::log2(ModeError(2e-4f, 4e-2f) / ModeError(1e-4f, 1e-2f));
  const double variable = std::log2(VariableError(2e-4f, 4e-2f) / VariableError(1e-4f, 1e-2f));
  const double on_sphere = SphereError(1e-4f, 1e-2f);
  const double sphere = std::log2(on_sphere / SphereError(5e-5f, 2.5e-3f));
  report->Add("thermal.order.sphere_error_pct", 100 * on_sphere, "%");
  report->Add("thermal.order.sphere", sphere, "1");
  report->Add("thermal.order.eigenfunction", mode, "1");
  report->Add("thermal.order.variable", variable, "1");
  report->Add("thermal.order.space", std::min({mode, variable, sphere}), "1");
  report->Add("thermal.order.time", TimeOrder(), "1");
}

}  // namespace

void HeatCases(Report* report) {
  HeatOneSpot(report);
  HeatFastTip(report);
  EightSpots(report);
  Orders(report);
}

void PotentialCases(Report* report) {
  if (!report->Wants("thermal.potential_")) return;
  const RingsResult result = SolveRings(6.3, 29.2, kWorkingTolerance);
  report->Add("thermal.potential_window.ms", result.solve_ms_warm, "ms");
  report->Add("thermal.potential_window.cold_ms", result.solve_ms_cold, "ms");
  report->Add("thermal.potential_window.q_error_pct", 100 * result.heat_error, "%");
  report->Add("thermal.potential_log.current_error_pct", 100 * result.current_error, "%");
}

}  // namespace fulcrum::thermal
