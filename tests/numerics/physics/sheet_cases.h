// The membrane's model against theory: moduli by direction, a disc under pressure (Hencky), lifted and dragged in its
// plane. Flat sheet without prestrain, bending or organ, E t = 150 N/m.
#pragma once

#include "services/base/core/scene_view.h"

namespace fulcrum::physics {

/// Linear moduli of the grid, over 180 directions.
struct DirectionalModuli {
  double modulus_spread = 0;  ///< Largest |E(direction) / E - 1|.
  double poisson_error = 0;   ///< Largest |nu(direction) - 1/2|.
};
[[nodiscard]] DirectionalModuli MeasureModuli(MembraneModel model);

/// Deflection in the middle of a clamped disc of n cells a radius under pressure, relative to Hencky's solution,
/// less 1.
[[nodiscard]] double HenckyDisc(MembraneModel model, int n);

/// A disc of n cells a radius that is clamped at its rim and lifted by a rigid round plate of a quarter of its radius,
/// by half of its radius.
struct Lift {
  double shape_error = 0;  ///< RMS distance of the nodes from the axisymmetric solution over RMS displacement.
  double force_error = 0;  ///< Force over that of the axisymmetric solution, less 1.
  double asymmetry = 0;    ///< RMS difference of the shape from its mirror image over RMS displacement.
};
[[nodiscard]] Lift LiftDisc(MembraneModel model, int n);

/// The same disc, the plate moved in its plane by 0.15 of the radius, at 0, 22.5, ... 157.5 degrees.
struct Drag {
  double anisotropy = 0;  ///< Largest |force / mean - 1|.
  double side = 0;        ///< Largest force across the motion over that along it.
};
[[nodiscard]] Drag DragDisc(MembraneModel model, int n);

}  // namespace fulcrum::physics
