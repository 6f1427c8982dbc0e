// Sessions with a known verdict, compared with the verdict of `fulcrum up`. guard.verdict_wrong counts the differences;
// the names of these sessions and the reasons are written to standard error.
#include <algorithm>
#include <cstdio>

#include "tests/benchmark/report.h"
#include "tests/support/verdict_scenarios.h"

namespace fulcrum {
namespace {

constexpr int kDomain = 78;

void Verdicts(benchmark::Report* report) {
  int wrong = 0, run = 0;
  double back_s = 0;
  for (const testing::Scenario& scenario : testing::VerdictScenarios()) {
    if (report->quick() && scenario.is_real) continue;
    if (!report->Wants("guard.verdict") && !scenario.name.starts_with("picture_")) continue;
    const testing::ScenarioResult result = testing::RunScenario(scenario, kDomain);
    ++run;
    back_s = std::max(back_s, result.picture_back_s);
    std::fprintf(stderr, "%-28s %s\n", scenario.name.c_str(), result.wrong.empty() ? "right" : result.wrong.c_str());
    if (result.picture_back_s >= 0) std::fprintf(stderr, "  the next picture after %.2f s\n", result.picture_back_s);
    if (result.wrong.empty()) continue;
    ++wrong;
    std::fprintf(stderr, "%s\n", result.said.c_str());
  }
  report->Add("guard.verdict_wrong", wrong, "sessions");
  report->Add("guard.verdict_scenarios", run, "sessions");
  if (!report->quick()) report->Add("guard.picture_back_s_max", back_s, "s");
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  if (report.Wants("guard.verdict") || report.Wants("guard.picture_back")) fulcrum::Verdicts(&report);
}
