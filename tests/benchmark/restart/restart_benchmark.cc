// kill -9 of each node of a real cart in turn, while it pulls and cuts. The benchmark reads every topic and tells how
// long it took until the new process was of use, what was lost, and what the hands felt.
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/cart_watch.h"
#include "tests/support/kill_session.h"
#include "tests/support/working_scene.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using testing::CartState;

constexpr int kDomain = 95;
constexpr int kKillsPerSession = 10, kKillsQuick = 3;
constexpr int kSessions = 2;
// Five nodes in turn: each lives a little longer than the 5 s after which the supervisor counts it as healthy, so none
// waits for its restart as one that dies again and again does.
constexpr double kBetweenKills_s = 1.03;
constexpr double kPatience_s = 20;
constexpr int kKillsOfASession = 20, kKillSessions = 10;

struct Node {
  NodeId id;
  const char* key;
};
constexpr std::array<Node, 5> kNodes{{{NodeId::kPhysics, "physics"},
                                      {NodeId::kThermal, "thermal"},
                                      {NodeId::kHaptics, "haptics"},
                                      {NodeId::kHandleBridge, "handle"},
                                      {NodeId::kRender, "render"}}};

struct Findings {
  std::map<NodeId, std::vector<double>> rejoin_ms;
  double tissue_lost_ms = 0, heat_lost_ms = 0, force_step_N = 0, force_N = 0;
  std::uint64_t topology_lost = 0, shared_memory_left_B = 0;
};

/// A cart file with which kills do not make a session end badly.
fs::path CartThatAllowsKills(const fs::path& folder) {
  std::ofstream(folder / "cart.yaml") << "verdict: {restarts: 1000}\n";
  return folder / "cart.yaml";
}

/// Kills one node; false when nothing was heard of its successor.
bool Kill(const Node& node, const testing::Cart& cart, testing::CartWatch* watch, Findings* findings) {
  const auto processes = cart.nodes();
  const auto victim = processes.find(NodeName(node.id));
  if (victim == processes.end()) return false;
  const auto index = static_cast<std::size_t>(node.id);
  std::uint64_t epoch = 0;
  std::int64_t sealed_ns = 0;
  watch->See([&](const CartState& state) {
    epoch = state.voices[index].epoch;
    if (node.id == NodeId::kThermal) sealed_ns = state.seals.at(node.id).before_ns;
  });
  const std::int64_t killed_ns = runtime::MonotonicNs();
  ::kill(victim->second, SIGKILL);
  if (node.id == NodeId::kThermal) {
    findings->heat_lost_ms = std::max(findings->heat_lost_ms, 1e-6 * static_cast<double>(killed_ns - sealed_ns));
  }
  std::int64_t heard_ns = 0;
  const bool heard = watch->WaitUntil(kPatience_s, [&](const CartState& state) {
    heard_ns = state.voices[index].heard_ns;
    return state.voices[index].epoch > epoch;
  });
  if (heard) findings->rejoin_ms[node.id].push_back(1e-6 * static_cast<double>(heard_ns - killed_ns));
  return heard;
}

/// One session in which each node is killed `rounds` times; what went wrong, or nothing.
std::string RunSession(int rounds, const fs::path& scene, Findings* findings) {
  testing::Cart cart(scene, kDomain, {"--cart", CartThatAllowsKills(scene.parent_path())});
  testing::CartWatch watch(kDomain, scene, cart.session());
  const bool works = watch.WaitUntil(60, [](const CartState& state) {
    return state.topology.revision > 0 && state.peak_force_N() > 0.1 &&
           state.voices[static_cast<std::size_t>(NodeId::kRender)].epoch > 0;
  });
  if (!works) return "the cart did not come to work\n" + cart.Said();
  auto next = std::chrono::steady_clock::now();
  for (int round = 0; round < rounds; ++round) {
    for (const Node& node : kNodes) {
      std::this_thread::sleep_until(next);
      next = std::chrono::steady_clock::now() +
             std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(kBetweenKills_s));
      if (!Kill(node, cart, &watch, findings)) return std::string(node.key) + " was not heard again\n" + cart.Said();
    }
  }
  std::this_thread::sleep_for(std::chrono::seconds(1));
  watch.See([&](const CartState& state) {
    findings->tissue_lost_ms = std::max(findings->tissue_lost_ms, 1e3 * state.tissue_lost_s);
    findings->topology_lost += state.topology_lost;
    findings->force_step_N = std::max(findings->force_step_N, state.peak_step_N());
    findings->force_N = std::max(findings->force_N, state.peak_force_N());
  });
  cart.Signal(SIGINT);
  const std::optional<int> code = cart.WaitForEnd(kPatience_s);
  if (code != 0) return "the session ended badly\n" + cart.Said();
  return {};
}

/// A session with a physics node in standby, whose leader is killed again and again; what went wrong, or nothing.
std::string RunStandby(int kills, const fs::path& scene, std::vector<double>* gap_ms, Findings* findings) {
  constexpr auto kIndex = static_cast<std::size_t>(NodeId::kPhysics);
  testing::Cart cart(scene, kDomain, {"--standby", "--cart", CartThatAllowsKills(scene.parent_path())});
  testing::CartWatch watch(kDomain, scene, cart.session());
  // A process that has just been relieved may not have heard of it when it last told of itself.
  constexpr std::uint64_t kHearsay_ns = 200'000'000;
  const auto leader = [](const CartState& state) {
    const auto health = state.healths.find(NodeId::kPhysics);
    const bool leads =
        health != state.healths.end() && health->second.state == HealthState::kRunning &&
        static_cast<std::uint64_t>(health->second.stamp.stamp_ns) > state.voices[kIndex].epoch + kHearsay_ns;
    return leads ? health->second.pid : 0;
  };
  if (!watch.WaitUntil(60, [&](const CartState& s) { return s.peak_force_N() > 0.1 && leader(s) != 0; })) {
    return "the cart did not come to work\n" + cart.Said();
  }
  for (int i = 0; i < kills; ++i) {
    // Each of the two lives for more than 5 s then, and comes back at once.
    std::this_thread::sleep_for(std::chrono::milliseconds(2700));
    if (!watch.WaitUntil(kPatience_s, [&](const CartState& s) { return leader(s) != 0; })) {
      return "nobody leads\n" + cart.Said();
    }
    const auto [epoch, pid] =
        watch.See([&](const CartState& s) { return std::pair(s.voices[kIndex].epoch, leader(s)); });
    const std::int64_t killed_ns = runtime::MonotonicNs();
    ::kill(pid, SIGKILL);
    std::int64_t heard_ns = 0;
    if (!watch.WaitUntil(kPatience_s, [&, before = epoch](const CartState& state) {
          heard_ns = state.voices[kIndex].heard_ns;
          return state.voices[kIndex].epoch > before;
        })) {
      return "nobody took over\n" + cart.Said();
    }
    gap_ms->push_back(1e-6 * static_cast<double>(heard_ns - killed_ns));
  }
  watch.See([&](const CartState& state) {
    findings->force_step_N = std::max(findings->force_step_N, state.peak_step_N());
    findings->force_N = std::max(findings->force_N, state.peak_force_N());
    findings->tissue_lost_ms = std::max(findings->tissue_lost_ms, 1e3 * state.tissue_lost_s);
  });
  cart.Signal(SIGINT);
  return cart.WaitForEnd(kPatience_s) == 0 ? std::string() : "the session ended badly\n" + cart.Said();
}

int Fail(const std::string& wrong) {
  std::fprintf(stderr, "bench_restart: %s\n", wrong.c_str());
  return 1;
}

int Standby(benchmark::Report* report) {
  const fs::path folder = fs::temp_directory_path() / ("bench_standby." + std::to_string(::getpid()));
  fs::create_directories(folder);
  const fs::path scene = folder / "working.yaml";
  std::ofstream(scene) << testing::WorkingScene("built-in", 120);
  std::vector<double> gap_ms;
  Findings findings;
  const std::string wrong = RunStandby(report->quick() ? kKillsQuick : 2 * kKillsPerSession, scene, &gap_ms, &findings);
  fs::remove_all(folder);
  if (!wrong.empty()) return Fail(wrong);
  report->Add("standby.gap_ms_p50", benchmark::Quantile(gap_ms, 0.5), "ms");
  report->Add("standby.gap_ms_max", benchmark::Quantile(gap_ms, 1), "ms");
  report->Add("standby.state_lost_ms_max", findings.tissue_lost_ms, "ms");
  report->Add("standby.force_step_N_max", findings.force_step_N, "N/ms");
  return 0;
}

/// 200 kills of every program of a session, the supervisor included, over ten sessions.
int Kills(benchmark::Report* report) {
  const fs::path folder = fs::temp_directory_path() / ("bench_kills." + std::to_string(::getpid()));
  fs::create_directories(folder);
  const fs::path scene = folder / "working.yaml";
  std::ofstream(scene) << testing::WorkingScene("built-in", 120);
  const int sessions = report->quick() ? 2 : kKillSessions;
  testing::KillFindings findings;
  for (int session = 0; session < sessions && findings.wrong.empty(); ++session) {
    const bool is_last = session + 1 == sessions;
    testing::RunKillSession(scene, kDomain, kKillsOfASession, session,
                            is_last ? testing::LastKill::kNone : testing::LastKill::kSupervisor, &findings);
  }
  fs::remove_all(folder);
  if (!findings.wrong.empty()) return Fail(findings.wrong);
  report->Add("guard.chaos.kills", findings.all(), "1");
  for (const auto& [program, count] : findings.kills) report->Add("guard.chaos.kills." + program, count, "1");
  report->Add("guard.chaos.lost_topology", static_cast<double>(findings.topology_lost), "1");
  report->Add("guard.chaos.unrecorded_topology", static_cast<double>(findings.topology_unrecorded), "1");
  report->Add("guard.chaos.recordings", findings.recordings, "1");
  report->Add("guard.chaos.recordings_cut_short", findings.cut_short, "1");
  report->Add("guard.chaos.damaged_recordings", findings.damaged, "1");
  report->Add("guard.chaos.unrecorded_s_max", findings.unrecorded_s_max, "s");
  report->Add("guard.chaos.shm_left_bytes", static_cast<double>(findings.shared_memory_left_B), "B");
  report->Add("guard.chaos.processes_left", findings.processes_left, "1");
  return 0;
}

int Run(benchmark::Report* report) {
  const fs::path folder = fs::temp_directory_path() / ("bench_restart." + std::to_string(::getpid()));
  fs::create_directories(folder);
  const int sessions = report->quick() ? 1 : kSessions;
  const int rounds = report->quick() ? kKillsQuick : kKillsPerSession;
  const fs::path scene = folder / "working.yaml";
  std::ofstream(scene) << testing::WorkingScene("built-in", 120);
  Findings findings;
  std::string wrong;
  for (int session = 0; session < sessions && wrong.empty(); ++session) {
    wrong = RunSession(rounds, scene, &findings);
    findings.shared_memory_left_B += testing::SharedMemoryLeft(kDomain);
  }
  fs::remove_all(folder);
  if (!wrong.empty()) return Fail(wrong);
  for (const Node& node : kNodes) {
    const auto& times = findings.rejoin_ms[node.id];
    report->Add(std::string("restart.rejoin_ms_p50.") + node.key, benchmark::Quantile(times, 0.5), "ms");
    report->Add(std::string("restart.rejoin_ms_max.") + node.key, benchmark::Quantile(times, 1), "ms");
  }
  report->Add("restart.lost_topology_events", static_cast<double>(findings.topology_lost), "1");
  report->Add("restart.state_lost_ms_max.tissue", findings.tissue_lost_ms, "ms");
  report->Add("restart.state_lost_ms_max.heat", findings.heat_lost_ms, "ms");
  report->Add("restart.force_step_N_max", findings.force_step_N, "N/ms");
  report->Add("restart.force_N_max", findings.force_N, "N");
  report->Add("restart.shm_left_bytes", static_cast<double>(findings.shared_memory_left_B), "B");
  return 0;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  int code = 0;
  if (report.Wants("restart.")) code = fulcrum::Run(&report);
  if (report.Wants("standby.")) code = std::max(code, fulcrum::Standby(&report));
  if (report.Wants("guard.chaos.")) code = std::max(code, fulcrum::Kills(&report));
  return code;
}
