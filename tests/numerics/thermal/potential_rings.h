// Potential between two concentric circles, against the logarithm.
#pragma once

#include "thermal_node/potential/potential_solver.h"

namespace fulcrum::thermal {

struct RingsResult {
  double current_error = 0;  ///< Relative, of the conductance 2 pi sigma d / ln(b/a).
  double heat_error = 0;     ///< Largest relative error of the heat in a cell midway, where it is resolved.
  double solve_ms_cold = 0, solve_ms_warm = 0;
  int iterations_cold = 0, iterations_warm = 0;
};

/// Inner circle of `inner` cells at 1 V, outer of `outer` cells at 0 V, in the 64 x 64 window.
RingsResult SolveRings(double inner, double outer, float tolerance);

}  // namespace fulcrum::thermal
