// Faults in the report of a session that a slow machine does not explain.
#pragma once

#include <sstream>
#include <string>

namespace fulcrum::testing {

/// Lines `fault at` of what `fulcrum up` printed, without those of nodes that ran too slowly: missed periods and low
/// rates are faults of the machine to a test of behaviour. So is a picture of more than a second: the software
/// rasteriser has the lowest priority and gets what the other nodes leave.
[[nodiscard]] inline std::string FaultsButPace(const std::string& said) {
  std::string faults;
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("fault at ")) continue;
    const bool missed = line.find(" of its periods; at most ") != std::string::npos;
    const bool slow = line.find(" Hz over ") != std::string::npos;
    const bool drawing = line.find(" render_node was stuck for ") != std::string::npos;
    if (!missed && !slow && !drawing) faults += line + "\n";
  }
  return faults;
}

}  // namespace fulcrum::testing
