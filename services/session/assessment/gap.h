#pragma once

namespace fulcrum::assessment {

/// Longer silence of a topic is a gap: what happened in it is not known and not counted [s].
inline constexpr double kGap_s = 0.1;

}  // namespace fulcrum::assessment
