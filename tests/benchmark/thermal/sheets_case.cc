// Sheets with their own heat: resistance of a band against that of a strip, and the time of a frame in a band against
// that in the same sheet on fat.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/benchmark/thermal/thermal_cases.h"
#include "tests/numerics/thermal/flat_sheets.h"

namespace fulcrum::thermal {
namespace {

void Resistance(benchmark::Report* report) {
  double worst = 0;
  for (const float d : {1.5e-4f, 3e-4f, 6e-4f}) {
    for (const float at_m : {0.012f, 0.006f, 0.002f}) {
      const SheetHeat heat{d, 0, 0};
      const double measured = BandResistance({}, heat, 0.003f, 0.024f, at_m, 5e-4f);
      const double exact = StripResistance({}, heat, 0.003, 0.024, static_cast<double>(at_m), 5e-4);
      worst = std::max(worst, std::abs(measured / exact - 1));
    }
  }
  report->Add("thermal.sheets.band_resistance_error_pct", 100 * worst, "%");
}

/// Frames of a cut across a sheet of 15 x 25 mm; the two sheets of a scene take turns, frame by frame.
void Cut(benchmark::Report* report) {
  constexpr float kOther_m = 0.0256f;
  const std::array<FlatSheet, 2> sheets{
      FlatSheet{.rows = 26, .cols = 16, .over = kNoIndex},
      FlatSheet{.rows = 26, .cols = 16, .x_m = kOther_m, .heat = {1.5e-4f, 0.3f, 0.2f}}};
  const scene::SceneData data = FlatSheets(sheets, 1e-3f);
  ThermalSolver band(data.View()), on_fat(data.View()), both(data.View());
  Drag drag;
  drag.from = {0.00203f, 0.01213f};
  drag.to = {0.01303f, 0.01213f};
  drag.tented = true;
  Drag other = drag;
  other.from.x() += kOther_m;
  other.to.x() += kOther_m;
  other.tented = false;
  std::vector<double> of_band, of_fat;
  for (int frame = 0; frame < drag.frames(kFrame_s); ++frame) {
    of_band.push_back(benchmark::TimeMs(0, 1, [&] { band.Step(drag.At(frame, kFrame_s), kFrame_s); }).front());
    of_fat.push_back(benchmark::TimeMs(0, 1, [&] { on_fat.Step(other.At(frame, kFrame_s), kFrame_s); }).front());
    both.Step(drag.At(frame, kFrame_s), kFrame_s);
  }
  for (int frame = 0; frame < other.frames(kFrame_s); ++frame) both.Step(other.At(frame, kFrame_s), kFrame_s);
  const double p50_band = benchmark::Quantile(of_band, 0.5), p50_fat = benchmark::Quantile(of_fat, 0.5);
  report->Add("thermal.sheets.band_frame_ms_p50", p50_band, "ms");
  report->Add("thermal.sheets.band_frame_ms_p99", benchmark::Quantile(of_band, 0.99), "ms");
  report->Add("thermal.sheets.on_fat_frame_ms_p50", p50_fat, "ms");
  report->Add("thermal.sheets.band_over_fat", p50_band / p50_fat, "1");
  report->Add("thermal.sheets.band_awake_tiles", static_cast<double>(band.field().awake().size()), "1");
  report->Add("thermal.sheets.in_turn_energy_closure_rel", both.ledger().ClosureError(both.field().Stored()), "1");
}

}  // namespace

void SheetsCases(benchmark::Report* report) {
  if (!report->Wants("thermal.sheets.")) return;
  Resistance(report);
  Cut(report);
}

}  // namespace fulcrum::thermal
