// Lock-step replay of a session of the real cart.
//
//   replay.hash_mismatches    states that differ, of physics, thermal and haptics over the whole recording
//   replay.states_compared
//   video.fps_p50, video.s_per_session_s   of the session as a video
//   dataset.frames_per_s      all channels of a left camera, pictures of a right one
//   replay.speed_x_realtime   physics and thermal together, physics on as many threads as there are cores
//   replay.busy_speed_x_realtime   the same while another program keeps one core busy
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/replay_run.h"

namespace fulcrum {
namespace {

constexpr int kDomain = 58;
constexpr double kPatience_s = 120;

int Fail(const char* what, const std::string& said) {
  std::fprintf(stderr, "bench_replay: %s\n%s", what, said.c_str());
  return 1;
}

bool MakeVideo(const std::filesystem::path& recording, benchmark::Report* report) {
  const auto begin = std::chrono::steady_clock::now();
  const auto video = recording.parent_path() / "video.mp4";
  const auto run = testing::Replay(recording, {"--video", video}, kPatience_s);
  const std::chrono::duration<double> used = std::chrono::steady_clock::now() - begin;
  if (run.exit_code != 0) return Fail("there is no video", run.said) == 0;
  report->Add("video.fps_p50", run.figures.at("draw_rate_Hz"), "1/s");
  report->Add("video.s_per_session_s", used.count() / run.figures.at("duration_s"), "1");
  return true;
}

bool MakeDataset(const std::filesystem::path& recording, benchmark::Report* report) {
  const auto begin = std::chrono::steady_clock::now();
  const auto run =
      testing::Replay(recording, {"--dataset", recording.parent_path() / "dataset", "--every", "0.05"}, 600);
  const std::chrono::duration<double> used = std::chrono::steady_clock::now() - begin;
  if (run.exit_code != 0) return Fail("there is no data set", run.said) == 0;
  report->Add("dataset.frames_per_s", run.figures.at("frames") / used.count(), "1/s");
  return true;
}

/// Returns what a replay said that failed.
std::string MeasureSpeed(const char* key, const std::filesystem::path& recording, benchmark::Report* report) {
  std::vector<double> speeds;
  for (int i = 0; i < 3; ++i) {
    const auto run = testing::Replay(recording, {"--into", "physics", "thermal"}, kPatience_s);
    if (run.exit_code != 0) return run.said;
    speeds.push_back(run.figures.at("speed_x_realtime"));
  }
  report->Add(key, benchmark::Quantile(speeds, 0.5), "1");
  return {};
}

int Run(benchmark::Report* report) {
  testing::Cart cart(report->quick() ? "small" : "built-in", kDomain, {"--record"});
  if (cart.WaitForEnd(kPatience_s) != 0) return Fail("the session did not end well", cart.Said());
  const auto recording = cart.session() / "recording.mcap";
  const auto all = testing::Replay(recording, {"--into", "physics", "thermal", "haptics"}, kPatience_s);
  double mismatches = 0, compared = 0;
  for (const char* node : {"physics_node", "thermal_node", "haptics_node"}) {
    mismatches +=
        all.figures.contains(std::string(node) + ".mismatches") ? all.figures.at(std::string(node) + ".mismatches") : 1;
    if (all.figures.contains(std::string(node) + ".compared")) {
      compared += all.figures.at(std::string(node) + ".compared");
    }
  }
  if (all.exit_code != 0) std::fprintf(stderr, "%s", all.said.c_str());
  report->Add("replay.hash_mismatches", mismatches, "states");
  report->Add("replay.states_compared", compared, "states");
  const std::string fault = MeasureSpeed("replay.speed_x_realtime", recording, report);
  if (!fault.empty()) return Fail("the replay differs", fault);
  {
    std::jthread busy([](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
      }
    });
    const std::string beside = MeasureSpeed("replay.busy_speed_x_realtime", recording, report);
    if (!beside.empty()) return Fail("the replay differs beside another program", beside);
  }
  if (report->Wants("video.") && !MakeVideo(recording, report)) return 1;
  if (report->Wants("dataset.") && !MakeDataset(recording, report)) return 1;
  return all.exit_code;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  return report.Wants("replay.") || report.Wants("video.") || report.Wants("dataset.") ? fulcrum::Run(&report) : 0;
}
