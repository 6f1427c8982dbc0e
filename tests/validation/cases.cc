// Every case by name, with its meshes. Cases of tests/numerics against exact solutions give their errors; those against
// another solver or an experiment give the quantity itself.
#include <cmath>

#include "tests/numerics/physics/analytic_cases.h"
#include "tests/numerics/physics/sheet_cases.h"
#include "tests/numerics/thermal/electrode_current.h"
#include "tests/numerics/thermal/heat_cases.h"
#include "tests/numerics/thermal/mesentery.h"
#include "tests/numerics/thermal/moving_gaussian.h"
#include "tests/numerics/thermal/potential_rings.h"
#include "tests/numerics/thermal/published.h"
#include "tests/validation/solid_cases.h"
#include "tests/validation/validation.h"

namespace fulcrum::validation {
namespace {

/// The organ's Poisson's ratio.
constexpr double kOrganPoisson = 0.45;
/// Cells of the membrane a radius of a disc: 1 mm, as the membrane of built-in has, at 16.
constexpr int kCellsOfDisc = 16;
constexpr float kHeatCell_m = 1e-4f;

/// A number of elements of the default mesh, on this mesh.
int Elements(Mesh mesh, int at_default) {
  return mesh == Mesh::kHalf ? at_default / 2 : mesh == Mesh::kTwice ? 2 * at_default : at_default;
}
float HeatCell(Mesh mesh) { return kHeatCell_m * (mesh == Mesh::kHalf ? 2 : mesh == Mesh::kTwice ? 0.5f : 1); }

Quantities OnTheDefaultAlone(Mesh mesh, const std::function<Quantities()>& run) {
  return mesh == Mesh::kDefault ? run() : Quantities{};
}

Quantities Moduli(Mesh mesh) {
  return OnTheDefaultAlone(mesh, [] {
    const physics::DirectionalModuli moduli = physics::MeasureModuli(MembraneModel::kContinuum);
    return Quantities{{"sheet.modulus_spread", 100 * moduli.modulus_spread},
                      {"sheet.poisson_error", 100 * moduli.poisson_error}};
  });
}

Quantities Drag(Mesh mesh) {
  const physics::Drag drag = physics::DragDisc(MembraneModel::kContinuum, Elements(mesh, kCellsOfDisc));
  return {{"sheet.drag_spread", 100 * drag.anisotropy}, {"sheet.drag_side", 100 * drag.side}};
}

Quantities Lift(Mesh mesh) {
  const physics::Lift lift = physics::LiftDisc(MembraneModel::kContinuum, Elements(mesh, kCellsOfDisc));
  return {{"sheet.lift_shape", 100 * lift.shape_error}, {"sheet.lift_force", 100 * lift.force_error}};
}

Quantities Hencky(Mesh mesh) {
  return {{"sheet.hencky", 100 * physics::HenckyDisc(MembraneModel::kContinuum, Elements(mesh, kCellsOfDisc))}};
}

Quantities Hang(Mesh mesh) { return {{"sheet.hang", 100 * physics::HangingSheet(Elements(mesh, kCellsOfDisc))}}; }

Quantities Bar(Mesh mesh) {
  const physics::BarErrors errors = physics::HangingBar(Elements(mesh, 4), kOrganPoisson);
  return {{"bar.stretch", 100 * errors.stretch}, {"bar.contraction", 100 * errors.contraction}};
}

Quantities Beam(Mesh mesh) {
  const int n = Elements(mesh, 4);
  return {{"beam.deflection", 100 * physics::Cantilever(n, kOrganPoisson)},
          {"beam.moment", 100 * physics::PureBending(n, kOrganPoisson)}};
}

/// The organ's wall has one layer, so there is no mesh half as fine.
Quantities LameOf(Mesh mesh) {
  if (mesh == Mesh::kHalf) return {};
  return {{"tube.widening", 100 * physics::LameTube(Elements(mesh, 1), kOrganPoisson)}};
}
Quantities PinchOf(Mesh mesh) { return mesh == Mesh::kHalf ? Quantities{} : Pinch(Elements(mesh, 1)); }
Quantities OvallingOf(Mesh mesh) { return mesh == Mesh::kHalf ? Quantities{} : VibrateTube(Elements(mesh, 1)); }

Quantities Conduct(Mesh mesh) {
  // The step is as long as the error in space allows: it falls with the square of the cell.
  const float cell = HeatCell(mesh), step = 0.01f * (cell / kHeatCell_m) * (cell / kHeatCell_m);
  return {{"conduct.mode", 100 * thermal::ModeError(cell, step)},
          {"conduct.sphere", 100 * thermal::SphereError(cell, step)}};
}

Quantities Stefan(Mesh mesh) { return {{"stefan.front", 100 * thermal::StefanError(HeatCell(mesh))}}; }

Quantities MovingSource(Mesh mesh) {
  return {{"source.moving", 100 * thermal::RunMovingGaussian(HeatCell(mesh)).max_error}};
}

Quantities Current(Mesh mesh) {
  return OnTheDefaultAlone(mesh, [] {
    const thermal::Material material = thermal::MakeMaterial(ThermalParams{});
    constexpr double kRadius_m = 5e-4, kRim_m = 4e-6, kNoArc_m = 1e-9;
    const double exact = thermal::SolveDiscInDepth(material, kRadius_m, kRim_m).conductance_S;
    const double drawn = thermal::WindowConductance(material, {.length_m = 0, .arc_m = kNoArc_m}, 0, {0.3f, 0.2f});
    constexpr double kInner = 6.3, kOuter = 29.2;
    constexpr float kTolerance = 1e-6f;
    return Quantities{{"current.rings", 100 * thermal::SolveRings(kInner, kOuter, kTolerance).current_error},
                      {"current.depth", 100 * (drawn / exact - 1)}};
  });
}

Quantities Mesentery(Mesh mesh) {
  return {{"spread.mesentery", thermal::RiseAtOneMillimetre({.cell_m = HeatCell(mesh)})}};
}

Quantities Peritoneum(Mesh mesh) { return {{"spread.peritoneum", 1e3 * thermal::LateralDamage(HeatCell(mesh))}}; }

Quantities Spread(Mesh mesh) { return {{"spread.45_degrees", 1e3 * thermal::SpreadOf45Degrees(HeatCell(mesh))}}; }

Quantities Cooling(Mesh mesh) {
  return {{"cooling.cut", thermal::CoolingTo60Degrees(CauteryMode::kCut, HeatCell(mesh))},
          {"cooling.coag", thermal::CoolingTo60Degrees(CauteryMode::kCoag, HeatCell(mesh))}};
}

/// 1 where the blade does what the publication saw.
Quantities Regimes(Mesh mesh) {
  constexpr double kVisible_mm2 = 0.1;
  const auto is = [mesh](float power_W, bool coagulates, bool cuts) {
    const thermal::Effect effect = thermal::BladeOnLiver(power_W, HeatCell(mesh));
    return (effect.coagulated_mm2 > kVisible_mm2) == coagulates && (effect.removed_mm2 > kVisible_mm2) == cuts ? 1.0
                                                                                                               : 0.0;
  };
  return {
      {"regime.10_W", is(10, false, false)}, {"regime.25_W", is(25, true, false)}, {"regime.50_W", is(50, true, true)}};
}

}  // namespace

const std::vector<Case>& Cases() {
  static const std::vector<Case> kCases{
      {"sheet-moduli", "A sheet of triangles, stretched a little in 180 directions.", Moduli},
      {"sheet-drag", "A disc of membrane whose middle is dragged in its plane in eight directions.", Drag},
      {"sheet-lift", "The same disc, its middle lifted by half of its radius.", Lift},
      {"sheet-hencky", "The same disc under pressure.", Hencky},
      {"sheet-hang", "A strip of the spring grid under its own weight.", Hang},
      {"bar-hang", "A solid bar under its own weight.", Bar},
      {"beam", "A clamped bar with a load at its end, and bent by a moment.", Beam},
      {"tube-pressure", "The organ's tube under inner pressure.", LameOf},
      {"tube-pinch", "The organ's tube, pinched by 30 % of its diameter.", PinchOf},
      {"block-dent", "A block pressed over a disc, dented by 5 % of its height.",
       [](Mesh mesh) { return Dent(Elements(mesh, 8)); }},
      {"beam-large", "A clamped bar bent by half of its length: large rotations.",
       [](Mesh mesh) { return Bend(Elements(mesh, 4)); }},
      {"beam-vibration", "Natural frequencies of a clamped bar.",
       [](Mesh mesh) { return VibrateBar(Elements(mesh, 4)); }},
      {"tube-vibration", "Natural frequency of the organ's tube that ovals.", OvallingOf},
      {"conduction", "Heat spreads in a square and over a sphere.", Conduct},
      {"boiling-front", "A hot wall drives a front of boiling into wet tissue for 1 s.", Stefan},
      {"moving-source", "A Gaussian source of heat that moves at 10 mm/s.", MovingSource},
      {"current", "Current between two circles, and from a disc into a sheet on fat.", Current},
      {"mesentery", "A hook of 0.5 mm at 30 W coag for 1 s on tented mesentery: rise 1 mm beside it.", Mesentery},
      {"peritoneum", "A stroke at 35 W cut: dead tissue beside it.", Peritoneum},
      {"spread", "A hook at 60 W coag for 1 s: how far 45 degrees reach.", Spread},
      {"cooling", "After a stroke at 40 W: time until the hottest tissue has cooled to 60 degrees.", Cooling},
      {"regimes", "A blade at 10, 25 and 50 W through liver: nothing, coagulation, and both it and a cut.", Regimes},
  };
  return kCases;
}

}  // namespace fulcrum::validation
