// A cart on two hosts: traffic of its tissue on the cable, load of the processors, and differences of force and picture
// from a cart on one host. Two network namespaces with clocks 1000 s apart; needs root.
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "services/transport/keys/key_folder.h"
#include "services/transport/link/codec/tissue_codec.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/working_scene.h"
#include "tests/system/two_hosts/two_hosts.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using benchmark::Quantile;
using testing::HeardTool;
using testing::TwoHosts;

const char* const kDomain = "62";
constexpr double kAhead_s = 1000;

struct Run {
  std::string wrong;  ///< Empty: all went well.
  std::vector<HeardTool> tools;
  testing::FrameComparison frames;
  std::vector<double> tissue_kB_per_s, offset_us, round_trip_us;
  double supervisor_cpu_pct = 0;  ///< Its process contains the link.
};

/// `seconds` of session time of a scene.
/// @param remote nodes on the far host; empty: all on the cart.
Run RunSession(const std::string& scene_yaml, double seconds, const std::string& remote,
               const TwoHosts::Settings& settings, bool with_tissue) {
  Run run;
  TwoHosts hosts(settings);
  const fs::path scene = hosts.folder() / "scene.yaml";
  std::ofstream(scene) << scene_yaml;
  const auto file = [&](const char* side) { return (hosts.folder() / side).string(); };
  std::vector<std::string> up{"up",  scene,   "--domain",  kDomain,     "--quality",
                              "low", "--out", file("out"), "--seconds", std::to_string(seconds)};
  std::optional<testing::Program> host;
  if (!remote.empty()) {
    const std::time_t now = std::time(nullptr);
    keys::MakeKeyFolder(file("keys"), {now, now + 24 * 3600}, false);
    up.insert(up.end(), {"--peer", TwoHosts::kHostAddress, "--remote", remote, "--keys", file("keys")});
    host = hosts.OnHost("fulcrum", {"host", "--peer", TwoHosts::kCartAddress, "--domain", kDomain, "--quality", "low",
                                    "--out", file("host"), "--cache", file("cache"), "--keys", file("keys")});
  }
  testing::Program cart = hosts.OnCart("fulcrum", up);
  std::vector<std::string> near_words{kDomain, file("near")}, far_words{kDomain, file("far"), "tissue"};
  if (with_tissue) near_words.emplace_back("tissue");
  testing::Program near = hosts.OnCart("two_hosts_probe", near_words);
  testing::Program far;
  if (with_tissue && !remote.empty()) far = hosts.OnHost("two_hosts_probe", far_words);
  // Load between the first and the last second of the session.
  const bool began = testing::WaitFor(90, [&] {
    const auto tools = testing::HeardTools(file("near"));
    return !tools.empty() && tools.back().time_s > 1;
  });
  if (!began) {
    run.wrong = "the cart did not come to work\n" + cart.Said() + (host ? host->Said() : "");
    return run;
  }
  const double cpu_before = testing::CpuSeconds(cart.pid()).value_or(0);
  const double watch_s = std::max(1.0, seconds - 3);
  std::this_thread::sleep_for(std::chrono::duration<double>(watch_s));
  run.supervisor_cpu_pct = 100 * (testing::CpuSeconds(cart.pid()).value_or(0) - cpu_before) / watch_s;
  const auto figures = [&](const char* name) { return testing::HeardLinkFigure(file("near"), name); };
  run.tissue_kB_per_s = figures("link_tissue_kB_per_s");
  run.offset_us = figures("link_clock_offset_us");
  run.round_trip_us = figures("link_round_trip_us");
  if (cart.End(0) != 0) run.wrong = "the session ended badly\n" + cart.Said() + (host ? host->Said() : "");
  near.End(SIGTERM);
  far.End(SIGTERM);
  run.tools = testing::HeardTools(file("near"));
  if (with_tissue && !remote.empty()) run.frames = testing::CompareFrames(file("near.tissue"), file("far.tissue"));
  return run;
}

/// RMS of the difference over RMS of the first, both tools, at equal milliseconds [%].
double ForceError(const std::vector<HeardTool>& wanted, const std::vector<HeardTool>& got) {
  std::map<long, const HeardTool*> by_ms;
  for (const HeardTool& tool : wanted) by_ms[std::lround(1e3 * tool.time_s)] = &tool;
  double error = 0, size = 0;
  for (const HeardTool& tool : got) {
    const auto same = by_ms.find(std::lround(1e3 * tool.time_s));
    if (tool.time_s < 0 || same == by_ms.end()) continue;
    const HeardTool& one = *same->second;
    error += std::pow(tool.force0_N - one.force0_N, 2) + std::pow(tool.force1_N - one.force1_N, 2);
    size += std::pow(one.force0_N, 2) + std::pow(one.force1_N, 2);
  }
  return size > 0 ? 100 * std::sqrt(error / size) : -1;
}

/// A scene in which no tool touches the tissue.
std::string Still() {
  std::string scene = testing::ReadFile(FULCRUM_SOURCE_DIR "/deploy/scenes/built-in.yaml");
  scene.resize(scene.find("\nscript:"));
  return scene +
         "\nscript:\n  duration_s: 60\n  tool0:\n    - {time_s: 0, sheet: [0.3, 0.5], height_mm: 40, jaw_deg: 50}\n"
         "  tool1:\n    - {time_s: 0, sheet: [0.6, 0.5], height_mm: 40}\n";
}

/// The second half of the values: the first half contains the start.
std::vector<double> Late(std::vector<double> values) {
  values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values;
}

int Fail(const std::string& wrong) {
  std::fprintf(stderr, "bench_two_hosts: %s\n", wrong.c_str());
  return 1;
}

int Measure(benchmark::Report* report) {
  const double seconds = report->quick() ? 6 : 14;
  const TwoHosts::Settings clean{.delay_ms = 0.1, .loss_percent = 0, .far_clock_ahead_s = kAhead_s};
  const TwoHosts::Settings bad{.delay_ms = 5, .loss_percent = 1, .far_clock_ahead_s = kAhead_s};
  if (report->Wants("two_hosts.frame_kB_per_s.static")) {
    // The tissue must come to rest first: only the last values count.
    constexpr double kSettle_s = 20;
    const Run still = RunSession(Still(), kSettle_s, "render_node", clean, false);
    if (!still.wrong.empty()) return Fail(still.wrong);
    report->Add("two_hosts.frame_kB_per_s.static", Quantile(Late(Late(Late(still.tissue_kB_per_s))), 0.5), "kB/s");
  }
  if (report->Wants("two_hosts.frame_error") || report->Wants("two_hosts.frame_age") ||
      report->Wants("two_hosts.frame_kB_per_s.moving") || report->Wants("two_hosts.link")) {
    const Run moving = RunSession(testing::WorkingScene("built-in", 120), seconds, "render_node", clean, true);
    if (!moving.wrong.empty()) return Fail(moving.wrong);
    report->Add("two_hosts.frame_kB_per_s.moving", Quantile(Late(moving.tissue_kB_per_s), 0.5), "kB/s");
    report->Add("two_hosts.frame_kB_per_s.moving_max", Quantile(moving.tissue_kB_per_s, 1), "kB/s");
    report->Add("two_hosts.frame_error_um", 1e6 * moving.frames.largest_error_m, "um");
    report->Add("two_hosts.frame_error_bound_um", 1e6 * link::kTissueError_m, "um");
    report->Add("two_hosts.frame_age_ms", 1e3 * moving.frames.median_age_s, "ms");
    const Run alone = RunSession(testing::WorkingScene("built-in", 120), 6, "", {}, false);
    if (!alone.wrong.empty()) return Fail(alone.wrong);
    report->Add("two_hosts.link_cpu_pct", moving.supervisor_cpu_pct - alone.supervisor_cpu_pct, "%");
  }
  if (report->Wants("two_hosts.force") || report->Wants("two_hosts.clock")) {
    const std::string scene = testing::ReadFile(FULCRUM_SOURCE_DIR "/deploy/scenes/small.yaml");
    constexpr double kScript_s = 6;
    const Run one = RunSession(scene, kScript_s, "", {}, false), again = RunSession(scene, kScript_s, "", {}, false);
    const Run two = RunSession(scene, kScript_s, "physics_node", bad, false);
    for (const Run* run : {&one, &again, &two}) {
      if (!run->wrong.empty()) return Fail(run->wrong);
    }
    report->Add("two_hosts.force_error_pct", ForceError(one.tools, two.tools), "%");
    report->Add("two_hosts.force_repeat_pct", ForceError(one.tools, again.tools), "%");
    double worst_us = 0;
    for (const double offset_us : two.offset_us) {
      if (offset_us == 0) continue;  // Not known yet.
      worst_us = std::max(worst_us, std::abs(offset_us - 1e6 * kAhead_s));
    }
    report->Add("two_hosts.clock_offset_error_us", worst_us, "us");
    report->Add("two_hosts.round_trip_us", Quantile(Late(two.round_trip_us), 0.5), "us");
  }
  return 0;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  if (!report.Wants("two_hosts.")) return 0;
  if (const std::string why = fulcrum::testing::TwoHosts::WhyNot(); !why.empty()) {
    std::fprintf(stderr, "bench_two_hosts: skipped: %s\n", why.c_str());
    return 0;
  }
  return fulcrum::Measure(&report);
}
