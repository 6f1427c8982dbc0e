// The operator's page in headless Chromium: time to the first paint and cost of the console while a page shows a
// session (console.*); pictures a second, cost of the stream, and time from an event of the pointer to a picture that
// shows it (hands.*). tests/integration/console/npm/measure.mjs and measure_hands.mjs measure them; without a browser
// no lines are printed.
#include <cstdio>
#include <sstream>
#include <string>

#include "tests/benchmark/report.h"

namespace {

constexpr const char* kRun =
    FULCRUM_SOURCE_DIR "/tests/integration/console/npm/run.sh " FULCRUM_BIN_DIR "/fulcrum " FULCRUM_CONSOLE_NPM " ";

std::string UnitOf(const std::string& key) {
  if (key.find("_ms") != std::string::npos) return "ms";
  if (key.find("_fps") != std::string::npos) return "Hz";
  return "%";
}

/// Runs the script and reports its lines below `prefix`. False: it failed.
bool Measure(const char* script, const std::string& prefix, fulcrum::benchmark::Report* report) {
  std::FILE* const output = ::popen((std::string(kRun) + script).c_str(), "r");
  if (output == nullptr) return false;
  char line[512];
  while (std::fgets(line, sizeof(line), output) != nullptr) {
    std::istringstream words(line);
    std::string key;
    double value = 0;
    if (words >> key >> value) {
      report->Add(prefix + key, value, UnitOf(key));
    } else {
      std::fprintf(stderr, "%s", line);
    }
  }
  const int status = ::pclose(output);
  constexpr int kSkipped = 77;
  return status == 0 || status >> 8 == kSkipped;
}

}  // namespace

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  bool well = true;
  if (report.Wants("console.")) well &= Measure("measure", "console.", &report);
  if (report.Wants("hands.browser_") || report.Wants("hands.stream_"))
    well &= Measure("measure_hands", "hands.", &report);
  return well ? 0 : 1;
}
