// A cut map as a picture.
#pragma once

#include <string>

#include "services/records/log_tools/cut_map.h"

namespace fulcrum::log_tools {

/// The sheet around the cut, s to the right and t upwards: hole, islands, heat and damage, the paths of the metal and
/// of the current, the centre line, and the figures beside it. Returns the content of a PNG file.
[[nodiscard]] std::string DrawCutMap(const CutMap& map, const std::string& title);

}  // namespace fulcrum::log_tools
