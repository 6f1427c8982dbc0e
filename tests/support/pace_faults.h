// Faults in the report of a session that a slow machine does not explain.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

namespace fulcrum::testing {

/// Whether a line `fault at` is of a node that ran slowly, but at a quarter of what was asked or more: to a test of
/// behaviour the fault of the machine. Of render_node any rate is, a picture of more than a second, its restarts for
/// that reason and a late return: the software rasteriser has the lowest priority and gets what the other nodes leave.
[[nodiscard]] inline bool IsOfPace(const std::string& line) {
  const auto after = [&line](const char* words) {
    const std::size_t at = line.find(words);
    return at == std::string::npos ? std::string() : line.substr(at);
  };
  double missed_pct = 0, rate_Hz = 0, asked_Hz = 0;
  const bool missed = std::sscanf(after(" missed ").c_str(), " missed %lf %% of its periods", &missed_pct) == 1;
  const bool slow = std::sscanf(after(" ran at ").c_str(), " ran at %lf of %lf Hz", &rate_Hz, &asked_Hz) == 2;
  if (line.find(": render_node ") != std::string::npos) {
    const auto says = [&line](const char* words) { return line.find(words) != std::string::npos; };
    return missed || slow || says(" was stuck for ") || says(" did not run again within ") ||
           (says(" died ") && says(" was stuck in a step for too long"));
  }
  return (missed && missed_pct <= 75) || (slow && rate_Hz >= 0.25 * asked_Hz);
}

/// Samples that a session's recording lacks according to what `fulcrum up` printed; 0: none, or no recording.
[[nodiscard]] inline int SamplesLost(const std::string& said) {
  const std::size_t end = said.find(" samples lost\n");
  const std::size_t begin = end == std::string::npos ? end : said.rfind(' ', end - 1);
  return begin == std::string::npos ? 0 : std::atoi(said.c_str() + begin + 1);
}

/// Lines `fault at` of what `fulcrum up` printed, without those of pace. A recorder that a busy machine wakes late
/// loses single samples of a best-effort topic: a few of the thousands of a session are of pace, too.
[[nodiscard]] inline std::string FaultsButPace(const std::string& said) {
  constexpr int kFewSamples = 10;
  const int lost = SamplesLost(said);
  std::string faults;
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    const bool few = line.ends_with("the recorder lost samples") && lost > 0 && lost <= kFewSamples;
    if (line.starts_with("fault at ") && !IsOfPace(line) && !few) faults += line + "\n";
  }
  return faults;
}

}  // namespace fulcrum::testing
