// A scene in which the tools never rest: what a cart is to go on doing while it is hurt.
#pragma once

#include <string>

namespace fulcrum::testing {

/// YAML of the shipped scene `base` ("small", "built-in") with an operator who takes the membrane with the grasper,
/// pulls it up and down once a second, and cuts line after line with the hook, all the time until `duration_s`.
/// @param nodes as in "[physics_node, thermal_node]"; empty: all.
[[nodiscard]] std::string WorkingScene(const std::string& base, double duration_s, const std::string& nodes = "");

}  // namespace fulcrum::testing
