// Models against theory. The membrane (tests/numerics/physics/sheet_cases.h) is minimised by the reference solver: what
// is left is the error of the model and its mesh, not that of a solver in real time. Heat
// (tests/numerics/thermal/heat_cases.h) is the product's own solver.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "physics_node/simulation/script_player.h"
#include "services/scene/builder/build.h"
#include "tests/benchmark/report.h"
#include "tests/benchmark/truth/hertz.h"
#include "tests/numerics/physics/sheet_cases.h"
#include "tests/numerics/thermal/electrode_current.h"
#include "tests/numerics/thermal/heat_cases.h"
#include "tests/numerics/thermal/mesentery.h"
#include "tests/validation/solid_cases.h"
#include "tests/validation/validation.h"

namespace fulcrum {
namespace {

using namespace physics;

/// Cells a radius: 1 mm, as the membrane of built-in has, at 16.
constexpr int kCells = 16;

double Order(double coarse, double fine) { return std::log2(std::abs(coarse / fine)); }

void MeasureSheet(const std::string& stem, MembraneModel model, benchmark::Report* report) {
  const auto wants = [&](const char* key) { return report->Wants(stem + key); };
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
    report->Add(stem + "lift_order", Order(lift.shape_error, LiftDisc(model, 2 * kCells).shape_error), "1");
  }
  if (wants("hencky_error_pct") || wants("hencky_order")) {
    const double error = HenckyDisc(model, kCells);
    report->Add(stem + "hencky_error_pct", 100 * std::abs(error), "%");
    report->Add(stem + "hencky_order", Order(error, HenckyDisc(model, 2 * kCells)), "1");
  }
}

/// Solids against CalculiX: the organ's tube with its one layer and with two, a block of as large elements.
void MeasureSolids(benchmark::Report* report) {
  if (!report->Wants("truth.tube.") && !report->Wants("truth.block.")) return;
  const validation::Expectations expected =
      validation::ReadExpectations(std::filesystem::path(FULCRUM_SOURCE_DIR) / "deploy/validation");
  const auto error_pct = [&](const validation::Quantities& results) {
    const auto& [quantity, value] = results.front();
    return 100 * std::abs(value / expected.at(quantity).value - 1);
  };
  report->Add("truth.tube.pinch_error_pct", error_pct(validation::Pinch(1)), "%");
  report->Add("truth.tube.pinch_error_pct.two_layers", error_pct(validation::Pinch(2)), "%");
  report->Add("truth.block.indent_error_pct", error_pct(validation::Dent(8)), "%");
}

/// A front of boiling in cells of the default 100 um. Order: of the mean square at times at which the front is in
/// different places of a cell.
void MeasureStefan(benchmark::Report* report) {
  if (!report->Wants("truth.stefan.")) return;
  const auto square = [](float cell_m) {
    double sum = 0;
    for (const double time_s : {0.5, 0.7, 1.0, 1.3, 1.6}) sum += std::pow(thermal::StefanError(cell_m, time_s), 2);
    return sum;
  };
  report->Add("truth.stefan.front_error_pct", 100 * std::abs(thermal::StefanError(1e-4f)), "%");
  report->Add("truth.stefan.order", 0.5 * Order(square(2e-4f), square(1e-4f)), "1");
}

void MeasureSource(benchmark::Report* report) {
  using thermal::RiseAtOneMillimetre;
  if (report->Wants("truth.potential.")) {
    const thermal::EnergyShares shares = thermal::SharesOfEnergy(thermal::MakeMaterial(ThermalParams{}));
    report->Add("truth.potential.sheet_energy_pct", 100 * shares.sheet, "%");
    report->Add("truth.potential.beyond_window_energy_pct", 100 * shares.beyond, "%");
    report->Add("truth.potential.unaccounted_energy_pct", 100 * std::abs(shares.unaccounted), "%");
    double largest = 0;
    for (const float sigma_fat : {0.02f, 0.035f, 0.1f}) {
      ThermalParams params;
      params.sigma_fat_S_m = sigma_fat;
      const thermal::Material material = thermal::MakeMaterial(params);
      const double depth = thermal::SolveDiscInDepth(material, 5e-4, 4e-6).conductance_S;
      const double drawn = thermal::WindowConductance(material, {.length_m = 0, .arc_m = 1e-9}, 0, {0.3f, 0.2f});
      largest = std::max(largest, std::abs(drawn / depth - 1));
    }
    report->Add("truth.potential.conductance_error_pct", 100 * largest, "%");
  }
  if (!report->Wants("truth.mesentery.")) return;
  for (const bool tented : {false, true}) {
    const std::string stem = tented ? "truth.mesentery.tented." : "truth.mesentery.on_fat.";
    std::vector<double> rises;
    for (const float cell_m : {4e-5f, 7e-5f, 1e-4f, 2e-4f}) {
      rises.push_back(RiseAtOneMillimetre({.tented = tented, .cell_m = cell_m}));
    }
    const auto [least, most] = std::minmax_element(rises.begin(), rises.end());
    report->Add(stem + "rise_K", rises[2], "K");
    report->Add(stem + "spread_K", *most - *least, "K");
  }
}

/// `built-in` with `finer` times the cells in each direction; wall and nodes that are bound to the organ stay.
scene::SceneData Refined(int finer) {
  scene::SceneSettings settings = scene::BuiltIn();
  settings.any_size = true;
  settings.physics.preset = PhysicsPreset::kReference;
  settings.tube.rings = finer * (settings.tube.rings - 1) + 1;
  settings.tube.segments *= finer;
  scene::MembraneSettings& m = settings.membrane;
  m.rows = finer * (m.rows - 1) + 1;
  m.cols = finer * (m.cols - 1) + 1;
  for (int* stride : {&m.bending_row_stride, &m.bending_col_stride, &m.binding_row_stride, &m.binding_col_stride}) {
    *stride *= finer;
  }
  return scene::BuildProcedural(settings);
}

/// Force on a grasper whose tip is pressed 1, 2, 3 and 4 mm below a point of the sheet, from 3 mm above it, at rest
/// [N].
std::array<double, 4> PressForces(const SceneView& scene, const Vec3f& place) {
  constexpr int kMove = 40, kRest = 40;
  constexpr float kNeither = 0.35f;  // Neither grasps nor lets go.
  TissueSimulation simulation(scene, 2);
  std::array<double, 4> forces{};
  std::array<ToolInput, kMaxTools> tools{};
  for (std::size_t depth = 0; depth < forces.size(); ++depth) {
    for (int i = 0; i < kMove + kRest; ++i) {
      const float from = depth == 0 ? -3 : static_cast<float>(depth), to = static_cast<float>(depth) + 1;
      const float mm = from + (to - from) * std::min(1.0f, static_cast<float>(i + 1) / kMove);
      tools[0] = {true, PoseAtTip(scene.tools[0], place - Vec3f(0, 0, 1e-3f * mm), kNeither)};
      (void)simulation.Step(tools);
    }
    forces[depth] = static_cast<double>(simulation.solver_force(0).norm());
  }
  return forces;
}

/// The default mesh against the limit of Richardson, of second order, from it and one twice as fine.
void MeasureMesh(benchmark::Report* report) {
  if (!report->Wants("truth.mesh.press")) return;
  const scene::SceneData usual = Refined(1), fine = Refined(2);
  const MembraneGrid& grid = usual.fixed.membrane;
  const Vec3f place = usual.rest_position[grid.first + grid.rows / 2 * grid.cols + grid.cols / 2];
  const std::array<double, 4> f1 = PressForces(usual.View(), place), f2 = PressForces(fine.View(), place);
  double largest = 0;
  for (std::size_t i = 0; i < f1.size(); ++i) {
    const double limit = f2[i] + (f2[i] - f1[i]) / 3;
    largest = std::max(largest, std::abs(f1[i] / limit - 1));
    const std::string stem = "truth.mesh.press_" + std::to_string(i + 1) + "_mm.";
    report->Add(stem + "force_N", f1[i], "N");
    report->Add(stem + "twice_as_fine_N", f2[i], "N");
  }
  report->Add("truth.mesh.press_error_pct", 100 * largest, "%");
}

/// The product's contact against Hertz, on a mesh with cells of 0.6 mm beneath the ball and on one with 0.4 mm.
void MeasureHertz(benchmark::Report* report) {
  if (!report->Wants("truth.contact.hertz")) return;
  for (const auto& [name, bricks] : {std::pair{"hertz", 12}, {"hertz_finer", 18}}) {
    double largest = 0;
    for (const HertzPoint& point : PressBall(bricks)) {
      largest = std::max(largest, std::abs(point.force_N / point.expected_N - 1));
      report->Add(std::string("truth.contact.") + name + "_" + std::to_string(std::lround(1e6 * point.depth_m)) +
                      "_um.force_over_expected",
                  point.force_N / point.expected_N, "1");
    }
    report->Add(std::string("truth.contact.") + name + "_error_pct", 100 * largest, "%");
  }
}

/// What others have measured on tissue: quantities, those within their tolerance, and the regimes of a blade on liver.
void MeasurePublished(benchmark::Report* report) {
  if (!report->Wants("truth.published.")) return;
  const validation::Expectations expected = validation::ReadExpectations(FULCRUM_SOURCE_DIR "/deploy/validation");
  int quantities = 0, within = 0, regimes = 0;
  for (const validation::Case& one : validation::Cases()) {
    for (const auto& [quantity, value] : one.run(validation::Mesh::kDefault)) {
      const validation::Expectation& what = expected.at(quantity);
      if (what.kind != "published") break;
      const bool right = std::abs(value / what.value - 1) <= 0.01 * what.tolerance_pct;
      ++quantities;
      within += right ? 1 : 0;
      regimes += right && quantity.starts_with("regime.") ? 1 : 0;
    }
  }
  report->Add("truth.published.quantities", quantities, "1");
  report->Add("truth.published.within_tolerance_pct", 100.0 * within / quantities, "%");
  report->Add("truth.published.regimes_right", regimes, "of 3");
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  fulcrum::MeasureSheet("truth.sheet.", fulcrum::MembraneModel::kContinuum, &report);
  fulcrum::MeasureSheet("truth.springs.", fulcrum::MembraneModel::kSprings, &report);
  fulcrum::MeasureSolids(&report);
  fulcrum::MeasureStefan(&report);
  fulcrum::MeasureSource(&report);
  fulcrum::MeasureHertz(&report);
  fulcrum::MeasureMesh(&report);
  fulcrum::MeasurePublished(&report);
}
