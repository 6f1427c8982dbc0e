#pragma once

namespace fulcrum::assessment {

/// A longer time between two messages of a topic is a gap [s]: the time in it is not counted.
inline constexpr double kGap_s = 0.1;

}  // namespace fulcrum::assessment
