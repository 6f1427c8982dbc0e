// The figures of a cut map that compare the hole with the metal's way and with what was reported.
#pragma once

#include "services/records/log_tools/cut_map.h"

namespace fulcrum::log_tools {

/// All figures but those of islands, pieces and areas. @pre `map` has its masks and its centre line.
void MeasureCut(CutMap* map);

}  // namespace fulcrum::log_tools
