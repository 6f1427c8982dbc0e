// The cells around the hook that are gone, for physics.
#pragma once

#include "services/base/core/messages.h"
#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

/// Fills the window around a place of the sheet. It moves in steps of kWindowStep cells, so that it seldom changes by
/// moving alone.
inline constexpr int kWindowStep = 8;
void FillOpenCells(const HeatField& field, const Vec2f& material, OpenCells* cells);

}  // namespace fulcrum::thermal
