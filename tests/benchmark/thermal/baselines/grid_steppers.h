// Textbook steppers of the heat equation on one uniform square grid without flux at its borders, in float: what the
// project's stepper is measured against. Linked only into the benchmark.
#pragma once

#include <memory>
#include <vector>

namespace fulcrum::thermal {

struct UniformGrid {
  int n = 0;  ///< Cells along the edge; a multiple of 16.
  double cell_m = 0;
  double diffusivity_m2_s = 0;
};

class GridStepper {
 public:
  virtual ~GridStepper() = default;
  /// One frame: `theta` [K], row by row, is advanced by dt under a source that adds `heating` [K] in that time.
  virtual void Step(std::vector<float>* theta, const std::vector<float>& heating, double dt_s) = 0;
};

/// Adds the heating, then forward Euler in as many equal substeps as stability needs; NaN-free for any step.
[[nodiscard]] std::unique_ptr<GridStepper> MakeForwardEuler(const UniformGrid& grid);
/// Peaceman and Rachford's alternating directions: both half steps implicit along one axis, half the source in each.
[[nodiscard]] std::unique_ptr<GridStepper> MakeAlternatingDirections(const UniformGrid& grid);
/// Crank-Nicolson by conjugate gradients from the last frame's temperature, to 1e-5 of the right hand side.
[[nodiscard]] std::unique_ptr<GridStepper> MakeCrankNicolson(const UniformGrid& grid);

}  // namespace fulcrum::thermal
