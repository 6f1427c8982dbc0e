#include "tests/support/kill_session.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>
#include <thread>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/records/recording/mcap_reader.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/topics.h"
#include "tests/support/cart.h"
#include "tests/support/cart_watch.h"
#include "tests/support/program.h"

namespace fulcrum::testing {
namespace {

namespace fs = std::filesystem;

// Each process runs a little longer than the 5 s after which the supervisor counts it as healthy. The supervisor
// therefore restarts it at once, without the delay for a node that fails repeatedly.
constexpr std::array kVictims{"recorder",     "physics_node",  "thermal_node",
                              "haptics_node", "handle_bridge", "render_node"};
constexpr double kBetweenKills_s = 0.9;
constexpr double kPatience_s = 30, kStart_s = 60;
// Time of samples that a killed recorder may lose [s] (services/records/recorder).
constexpr double kRecorderGrace_s = 1;

std::optional<NodeId> NodeOf(const std::string& program) {
  for (std::size_t i = 0; i < kNodeCount; ++i) {
    if (program == NodeName(static_cast<NodeId>(i))) return static_cast<NodeId>(i);
  }
  return std::nullopt;
}

bool IsGone(pid_t process) {
  (void)::waitpid(process, nullptr, WNOHANG);
  return ::kill(process, 0) != 0 && errno == ESRCH;
}

/// Faults that `fulcrum log verify` finds in a file, one line each, except samples that were sent while no recorder
/// ran.
std::string FaultsOf(const fs::path& file) {
  Program program("fulcrum", {"log", "verify", file});
  const int code = program.End(0);
  std::istringstream said(program.Said());
  std::string faults, line;
  bool gaps = false;
  while (std::getline(said, line)) {
    if (!line.starts_with("! ")) continue;
    const bool gap = line.ends_with(" messages are missing in the sequence of their writer");
    gaps = gaps || gap;
    if (!gap) faults += line + "\n";
  }
  if (code != 0 && !gaps && faults.empty()) faults = program.Said();
  return faults;
}

/// Newest recorded state of a session, over its files.
struct Recorded {
  std::int64_t tool_ns = 0;
  std::uint64_t revision = 0;
};

void ReadRecording(const fs::path& file, Recorded* recorded) {
  recording::McapReader reader(file);
  recording::McapMessage message;
  ToolState tool;
  TopologyState topology;
  while (reader.Next(&message)) {
    const std::string& topic = reader.channels().at(message.channel).topic;
    if (topic == bus::RoleOf<ToolState>().name && bus::DecodeCdr(message.data, &tool)) {
      recorded->tool_ns = std::max(recorded->tool_ns, tool.stamp.stamp_ns);
    } else if (topic == bus::RoleOf<TopologyState>().name && bus::DecodeCdr(message.data, &topology)) {
      recorded->revision = std::max(recorded->revision, topology.revision);
    }
  }
}

Recorded LookAtRecordings(const fs::path& session, KillFindings* findings) {
  Recorded recorded;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(session)) {
    if (entry.path().extension() == ".mcap") files.push_back(entry.path());
  }
  for (const fs::path& file : files) {
    ++findings->recordings;
    fs::path sound = file;
    if (!FaultsOf(file).empty()) {
      ++findings->cut_short;
      sound = session / ("sound-" + file.filename().string());
      const int recovered = Program("fulcrum", {"log", "recover", file, "--out", sound}).End(0);
      const std::string faults = recovered == 0 ? FaultsOf(sound) : "cannot be recovered\n";
      if (!faults.empty()) {
        ++findings->damaged;
        findings->damage += file.string() + ":\n" + faults;
        continue;
      }
    }
    ReadRecording(sound, &recorded);
  }
  return recorded;
}

/// Kills the process of a node and waits until its successor works; returns an error, or nothing.
std::string KillNode(const std::string& program, const Cart& cart, CartWatch* watch) {
  const auto processes = cart.nodes();
  const auto victim = processes.find(program);
  if (victim == processes.end()) return program + " does not run";
  const std::optional<NodeId> node = NodeOf(program);
  const bool speaks = node && *node != NodeId::kRecorder;
  std::uint64_t epoch = 0;
  if (speaks) {
    watch->See([&](const CartState& state) { epoch = state.voices[static_cast<std::size_t>(*node)].epoch; });
  }
  ::kill(victim->second, SIGKILL);
  const bool back = speaks ? watch->WaitUntil(kPatience_s,
                                              [&](const CartState& state) {
                                                return state.voices[static_cast<std::size_t>(*node)].epoch > epoch;
                                              })
                           : WaitFor(kPatience_s, [&] {
                               const auto now = cart.nodes();
                               const auto successor = now.find(program);
                               return successor != now.end() && successor->second != victim->second;
                             });
  return back ? std::string() : program + " did not come back";
}

}  // namespace

std::uint64_t SharedMemoryLeft(int domain) {
  std::uint64_t bytes = 0;
  std::error_code none;
  const auto add = [&](const fs::directory_entry& entry) {
    // An empty file counts as left over, too.
    if (entry.is_regular_file(none)) bytes += std::max<std::uint64_t>(1, entry.file_size(none));
  };
  for (const auto& entry : fs::directory_iterator("/dev/shm", none)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("fastrtps_") || name.starts_with("fast_datasharing") || name.starts_with("sem.fastrtps")) {
      add(entry);
    }
  }
  for (const auto& entry : fs::recursive_directory_iterator(bus::SharedMemoryDirectory(domain), none)) add(entry);
  return bytes;
}

int KillFindings::all() const {
  int sum = 0;
  for (const auto& [program, count] : kills) sum += count;
  return sum;
}

void RunKillSession(const fs::path& scene, int domain, int kills, int turn, LastKill last, KillFindings* findings) {
  // Orphans become children of this process, which reaps them: a zombie would count as a process that is left.
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  // The verdict must not count the kills.
  const fs::path file = scene.parent_path() / "kills_cart.yaml";
  std::ofstream(file) << "verdict: {restarts: 1000}\n";
  Cart cart(scene, domain, {"--record", "--cart", file});
  CartWatch watch(domain, scene, cart.session());
  const bool works = watch.WaitUntil(kStart_s, [](const CartState& state) {
    return state.topology.revision > 0 && state.voices[static_cast<std::size_t>(NodeId::kRender)].epoch > 0;
  });
  if (!works) {
    findings->wrong = "the cart did not come to work\n" + cart.Said();
    return;
  }
  const fs::path session = fs::canonical(cart.session());
  const int nodes = last == LastKill::kSupervisor ? kills - 1 : kills;
  std::uint64_t due_revision = 0;  // Revision a second before the end of the recording.
  for (int i = 0; i < nodes; ++i) {
    due_revision = watch.See([](const CartState& state) { return state.topology.revision; });
    std::this_thread::sleep_for(std::chrono::duration<double>(kBetweenKills_s));
    const std::string victim = kVictims[static_cast<std::size_t>(turn + i) % kVictims.size()];
    findings->wrong = KillNode(victim, cart, &watch);
    if (!findings->wrong.empty()) {
      findings->wrong += "\n" + cart.Said();
      return;
    }
    ++findings->kills[victim];
  }
  std::this_thread::sleep_for(std::chrono::duration<double>(kRecorderGrace_s));
  const auto processes = cart.nodes();
  const std::int64_t end_ns = runtime::MonotonicNs();
  cart.Signal(last == LastKill::kSupervisor ? SIGKILL : SIGINT);
  if (last == LastKill::kSupervisor) ++findings->kills["fulcrum"];
  if (!cart.WaitForEnd(kPatience_s)) {
    findings->wrong = "the session did not end\n" + cart.Said();
    return;
  }
  WaitFor(kPatience_s, [&] {
    return std::all_of(processes.begin(), processes.end(), [](const auto& entry) { return IsGone(entry.second); });
  });
  for (const auto& [program, process] : processes) findings->processes_left += IsGone(process) ? 0 : 1;
  watch.See([&](const CartState& state) { findings->topology_lost += state.topology_lost; });
  findings->shared_memory_left_B += SharedMemoryLeft(domain);
  const Recorded recorded = LookAtRecordings(session, findings);
  findings->topology_unrecorded += due_revision - std::min(due_revision, recorded.revision);
  findings->unrecorded_s_max =
      std::max(findings->unrecorded_s_max, 1e-9 * static_cast<double>(end_ns - recorded.tool_ns));
}

}  // namespace fulcrum::testing
