// Several flat sheets in one scene, each with its own heat, for tests and benchmarks.
#pragma once

#include <span>

#include "services/base/core/sheet_heat.h"
#include "tests/numerics/thermal/flat_scene.h"

namespace fulcrum::thermal {

/// A rectangle of rows x cols nodes with its corner at (x, 0) in the atlas.
struct FlatSheet {
  std::uint32_t rows = 0, cols = 0;
  float x_m = 0;
  Index over = 0;  ///< kNoIndex: spanned freely.
  SheetHeat heat = {};
};

/// Default thermal parameters; nodes of no sheet are beside the first node of the sheet before them.
[[nodiscard]] scene::SceneData FlatSheets(std::span<const FlatSheet> sheets, float spacing_m);

/// One sheet with its corner at (0, 0).
[[nodiscard]] inline scene::SceneData OneSheet(const FlatSheet& sheet, float spacing_m) {
  return FlatSheets(std::span(&sheet, 1), spacing_m);
}

/// Resistance of a band spanned along t, of `length_m` between its ends, with a bar of metal of half width `radius_m`
/// across the whole of it at `at_m` from one end, at one volt: from the solver [Ohm].
[[nodiscard]] double BandResistance(const ThermalParams& params, const SheetHeat& heat, float width_m, float length_m,
                                    float at_m, float radius_m);

/// The same in closed form: of each part L / (sigma d w) from the metal to the end, and beneath the metal that of a
/// fin, whose contact conducts 2 sigma / d by area: coth(r / lambda) / (sqrt(2) sigma w), lambda = d / sqrt(2).
[[nodiscard]] double StripResistance(const ThermalParams& params, const SheetHeat& heat, double width_m,
                                     double length_m, double at_m, double radius_m);

}  // namespace fulcrum::thermal
