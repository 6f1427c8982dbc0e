// Bit field of the removed cells around the hook, for physics_node.
#pragma once

#include "services/base/core/messages.h"
#include "thermal_node/heat/heat_field.h"

namespace fulcrum::thermal {

/// The window moves in steps of this many cells, so that motion alone seldom changes it.
inline constexpr int kWindowStep = 8;
/// Fills the window around a place of the sheet.
void FillOpenCells(const HeatField& field, const Vec2f& material, OpenCells* cells);

}  // namespace fulcrum::thermal
