// A scene in which the tools move all the time: the work of a cart during fault tests.
#pragma once

#include <string>

namespace fulcrum::testing {

/// YAML of the shipped scene `base` ("small", "built-in") with a script that grasps the membrane, pulls it up and down
/// once a second, and cuts line after line with the hook until `duration_s`.
/// @param nodes as in "[physics_node, thermal_node]"; empty: all.
[[nodiscard]] std::string WorkingScene(const std::string& base, double duration_s, const std::string& nodes = "");

}  // namespace fulcrum::testing
