// The membrane's models against theory (tests/numerics/physics/sheet_cases.h). Minimised by the reference solver: what
// is left is the error of the model and its mesh, not that of a solver in real time.
#include <algorithm>
#include <cmath>
#include <string>

#include "tests/benchmark/report.h"
#include "tests/numerics/physics/sheet_cases.h"

namespace fulcrum::physics {
namespace {

/// Cells a radius: 1 mm, as the membrane of built-in has, at 16.
constexpr int kCells = 16;

void Measure(const std::string& stem, MembraneModel model, benchmark::Report* report) {
  const auto wants = [&](const char* key) { return report->Wants(stem + key); };
  const auto order = [](double coarse, double fine) { return std::log2(std::abs(coarse / fine)); };
  if (wants("directional_modulus_pct") || wants("poisson_error")) {
    const DirectionalModuli moduli = MeasureModuli(model);
    report->Add(stem + "directional_modulus_pct", 100 * moduli.modulus_spread, "%");
    report->Add(stem + "poisson_error", moduli.poisson_error, "1");
  }
  if (wants("inplane_anisotropy_pct") || wants("side_force_pct")) {
    const Drag drag = DragDisc(model, kCells);
    report->Add(stem + "inplane_anisotropy_pct", 100 * drag.anisotropy, "%");
    report->Add(stem + "side_force_pct", 100 * drag.side, "%");
  }
  if (wants("lift_error_pct") || wants("lift_force_error_pct") || wants("mirror_asymmetry_pct") ||
      wants("lift_order")) {
    const Lift lift = LiftDisc(model, kCells);
    report->Add(stem + "lift_error_pct", 100 * lift.shape_error, "%");
    report->Add(stem + "lift_force_error_pct", 100 * std::abs(lift.force_error), "%");
    report->Add(stem + "mirror_asymmetry_pct", 100 * lift.asymmetry, "%");
    report->Add(stem + "lift_order", order(lift.shape_error, LiftDisc(model, 2 * kCells).shape_error), "1");
  }
  if (wants("hencky_error_pct") || wants("hencky_order")) {
    const double error = HenckyDisc(model, kCells);
    report->Add(stem + "hencky_error_pct", 100 * std::abs(error), "%");
    report->Add(stem + "hencky_order", order(error, HenckyDisc(model, 2 * kCells)), "1");
  }
}

}  // namespace
}  // namespace fulcrum::physics

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  fulcrum::physics::Measure("truth.sheet.", fulcrum::MembraneModel::kContinuum, &report);
  fulcrum::physics::Measure("truth.springs.", fulcrum::MembraneModel::kSprings, &report);
}
