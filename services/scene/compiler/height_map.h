// An organ as seen along -z: a depth buffer.
#pragma once

#include <limits>

#include "services/scene/compiler/sheet_grid.h"

namespace fulcrum::scene {

inline constexpr int kHeightSamples = 129;  ///< Either way.
inline constexpr double kNoHeight = -std::numeric_limits<double>::infinity();

/// Height of the organ above each point of a rectangle of `width` (x, columns) by `length` (y, rows) around the origin;
/// kNoHeight beside the organ.
Grid<double> HeightsOf(const TriangleMesh& organ, double width, double length);

}  // namespace fulcrum::scene
