// Faults in the report of a session that a slow machine does not explain.
#pragma once

#include <cstdio>
#include <sstream>
#include <string>

namespace fulcrum::testing {

/// Whether a line `fault at` is of a node that ran slowly, but at a quarter of what was asked or more: to a test of
/// behaviour the fault of the machine. Of render_node any rate is, and a picture of more than a second: the software
/// rasteriser has the lowest priority and gets what the other nodes leave.
[[nodiscard]] inline bool IsOfPace(const std::string& line) {
  const auto after = [&line](const char* words) {
    const std::size_t at = line.find(words);
    return at == std::string::npos ? std::string() : line.substr(at);
  };
  double missed_pct = 0, rate_Hz = 0, asked_Hz = 0;
  const bool missed = std::sscanf(after(" missed ").c_str(), " missed %lf %% of its periods", &missed_pct) == 1;
  const bool slow = std::sscanf(after(" ran at ").c_str(), " ran at %lf of %lf Hz", &rate_Hz, &asked_Hz) == 2;
  if (line.find(": render_node ") != std::string::npos) {
    return missed || slow || line.find(" was stuck for ") != std::string::npos;
  }
  return (missed && missed_pct <= 75) || (slow && rate_Hz >= 0.25 * asked_Hz);
}

/// Lines `fault at` of what `fulcrum up` printed, without those of pace.
[[nodiscard]] inline std::string FaultsButPace(const std::string& said) {
  std::string faults;
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("fault at ") && !IsOfPace(line)) faults += line + "\n";
  }
  return faults;
}

}  // namespace fulcrum::testing
