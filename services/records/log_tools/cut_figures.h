// The figures of a cut map that compare the hole with the path of the metal and with the reported values.
#pragma once

#include "services/records/log_tools/cut_map.h"

namespace fulcrum::log_tools {

/// Computes all figures except those of islands, pieces and areas. @pre `map` has its masks and its centre line.
void MeasureCut(CutMap* map);

}  // namespace fulcrum::log_tools
