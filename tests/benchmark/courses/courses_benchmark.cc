// Whether scores tell an expert's hand from a novice's: each exercise of the courses in real sessions, performed by
// both hands with ten seeds of tremor, straying and delay (services/scene/builder/operator_hand.h).
// `courses.separate.SCENE` is the mean over the seeds of the difference of their scores, in standard deviations of that
// difference.
#include <atomic>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "services/session/training/course.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

constexpr int kFirstDomain = 41;  ///< One domain for each session that runs at the same time.
constexpr double kPatience_s = 120;

struct Trial {
  std::string scene, hand;
  int seed = 0;
};

/// Sessions that did not end well: a novice's hand may fail to do what the script demands, and its score counts.
std::atomic<int> not_well{0};

/// Score of one session [%]; NaN: it has none.
double ScoreOf(const Trial& trial, int domain) {
  testing::Cart cart(trial.scene, domain,
                     {"--set", "script.hand=" + trial.hand, "--set", "script.seed=" + std::to_string(trial.seed),
                      "--set", "render.png_rate_Hz=0"});
  const std::optional<int> code = cart.WaitForEnd(kPatience_s);
  if (code != 0) {
    std::fprintf(stderr, "%s, %s, seed %d: exit code %d\n%s\n", trial.scene.c_str(), trial.hand.c_str(), trial.seed,
                 code.value_or(-1), cart.Said().c_str());
    ++not_well;
  }
  return testing::FigureOf(testing::ReadFile(cart.session() / "assessment.json"), "score_pct");
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double Deviation(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += (value - Mean(values)) * (value - Mean(values));
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

void Run(benchmark::Report* report) {
  const int seeds = report->quick() ? 2 : 10;
  std::vector<Trial> trials;
  std::vector<std::string> scenes;
  for (const training::Course& course : training::ReadCourses(FULCRUM_SOURCE_DIR "/deploy/courses")) {
    for (const training::Exercise& exercise : course.exercises) {
      if (!report->Wants("courses.separate." + exercise.scene)) continue;
      scenes.push_back(exercise.scene);
      for (int seed = 1; seed <= seeds; ++seed) {
        for (const char* hand : {"expert", "novice"}) trials.push_back({exercise.scene, hand, seed});
      }
    }
  }
  std::map<std::pair<std::string, std::string>, std::vector<double>> scores;
  std::vector<double> score(trials.size());
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> workers;
  // Two at a time: scripted sessions do the same on a busy machine.
  for (int worker = 0; worker < 2; ++worker) {
    workers.emplace_back([&, worker] {
      for (std::size_t i = next++; i < trials.size(); i = next++) {
        score[i] = ScoreOf(trials[i], kFirstDomain + worker);
        std::fprintf(stderr, "%zu of %zu: %s, %s, seed %d: %.1f %%\n", i + 1, trials.size(), trials[i].scene.c_str(),
                     trials[i].hand.c_str(), trials[i].seed, score[i]);
      }
    });
  }
  for (std::thread& worker : workers) worker.join();
  for (std::size_t i = 0; i < trials.size(); ++i) scores[{trials[i].scene, trials[i].hand}].push_back(score[i]);
  for (const std::string& scene : scenes) {
    const std::vector<double>&expert = scores[{scene, "expert"}], &novice = scores[{scene, "novice"}];
    std::vector<double> difference;
    for (std::size_t k = 0; k < expert.size(); ++k) difference.push_back(expert[k] - novice[k]);
    report->Add("courses.separate." + scene, Mean(difference) / Deviation(difference), "sd");
    report->Add("courses.separate." + scene + ".expert_pct", Mean(expert), "%");
    report->Add("courses.separate." + scene + ".novice_pct", Mean(novice), "%");
  }
  report->Add("courses.not_well", not_well, "count");
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  if (report.Wants("courses.")) fulcrum::Run(&report);
  return 0;
}
