// The operator's page in headless Chromium: time to the first paint, cost of the console while a page shows a session,
// and age of the picture on the page. tests/integration/console/npm/measure.mjs measures them; without a browser no
// lines are printed.
#include <cstdio>
#include <sstream>
#include <string>

#include "tests/benchmark/report.h"

namespace {

constexpr const char* kCommand = FULCRUM_SOURCE_DIR "/tests/integration/console/npm/run.sh " FULCRUM_BIN_DIR
                                                    "/fulcrum " FULCRUM_CONSOLE_NPM " measure";

}  // namespace

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  if (!report.Wants("console.")) return 0;
  std::FILE* const output = ::popen(kCommand, "r");
  if (output == nullptr) return 1;
  char line[512];
  while (std::fgets(line, sizeof(line), output) != nullptr) {
    std::istringstream words(line);
    std::string key;
    double value = 0;
    if (words >> key >> value) {
      report.Add("console." + key, value, key.ends_with("_ms") ? "ms" : key.ends_with("_s") ? "s" : "%");
    } else {
      std::fprintf(stderr, "%s", line);
    }
  }
  const int status = ::pclose(output);
  constexpr int kSkipped = 77;
  return status == 0 || status >> 8 == kSkipped ? 0 : 1;
}
