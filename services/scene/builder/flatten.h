// Flattening of the membrane: material coordinates whose distances are those of the sheet at rest, as far as the
// curvature of the sheet allows.
#pragma once

#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::scene {

/// As-rigid-as-possible parametrisation of a rows x cols sheet (Liu, Zhang, Xu, Gotsman, Gortler 2008, "A local/global
/// approach to mesh parameterization"): alternates between the rotations of the triangles and the Poisson problem that
/// they define. s grows with the column, t with the row; the middle row lies along s. The smallest s and t are 0.
/// @param sheet nodes row by row [m]; no triangle may be degenerate. @return [rows * cols] (s, t) [m].
std::vector<Eigen::Vector2d> FlattenSheet(int rows, int cols, const std::vector<Vec3d>& sheet);

}  // namespace fulcrum::scene
