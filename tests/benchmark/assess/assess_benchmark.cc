// The assessment: error of each measure on sessions with known results, and the cost of a message.
#include <algorithm>
#include <cmath>
#include <map>

#include "services/session/assessment/assessor.h"
#include "tests/benchmark/report.h"
#include "tests/support/assessment_cases.h"

namespace fulcrum::benchmark {
namespace {

void MeasureErrors(Report* report) {
  std::map<std::string, double> worst;
  for (const test::KnownAnswer& answer : test::KnownAnswers()) {
    double& error = worst[answer.name.substr(0, answer.name.find('.'))];
    error = std::max(error, answer.error_pct());
  }
  // In the order of the score sheet.
  for (const MeasureInfo& info : kMeasures) {
    report->Add("assess." + std::string(info.name) + "_error_pct", worst.at(info.name), "%");
  }
}

template <class Make>
void MeasureCost(const char* name, int count, const Make& make, Report* report) {
  using Message = decltype(make(0));
  const test::AssessedScene scene;
  std::vector<Message> messages;
  messages.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) messages.push_back(make(i));
  const auto times_ms = TimeMs(1, report->quick() ? 3 : 15, [&] {
    assessment::Assessor assessor(scene.view);
    assessor.Begin(test::kStart_ns);
    for (const Message& message : messages) assessor.Add(message);
    DoNotOptimise(assessor.PromptsAt(0));
  });
  report->Add(std::string("assess.") + name + "_us", 1e3 * Quantile(times_ms, 0.5) / count, "us");
}

}  // namespace
}  // namespace fulcrum::benchmark

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  if (!report.Wants("assess.")) return 0;
  benchmark::MeasureErrors(&report);
  benchmark::MeasureCost(
      "tool_state", 20000,
      [](int i) {
        const double phase = 1e-3 * i;
        return test::ToolAt(phase, Vec3d(0.03 * std::cos(phase), 0.03 * std::sin(phase), 0), Vec3d::Zero());
      },
      &report);
  benchmark::MeasureCost(
      "contact_model", 5000, [](int i) { return test::PushAt(1e-2 * i, 2 + i % 5); }, &report);
  benchmark::MeasureCost(
      "cautery_contact", 5000,
      [](int i) {
        const float along = 0.02f + 0.04f * static_cast<float>(i) / 5000;
        return test::TipAt(1e-2 * i, Vec2f(0.021f, along), true);
      },
      &report);
  benchmark::MeasureCost(
      "patch", 60,
      [](int i) {
        const double front = 0.02 + 5e-5 * i;  // A cut of 3 mm/s at 60 patches a second.
        return test::PatchAt(i / 60.0, 100, 180, [=](const Eigen::Vector2d& at) {
          return at.y() < front && std::abs(at.x() - 0.02) < 0.001;
        });
      },
      &report);
  return 0;
}
