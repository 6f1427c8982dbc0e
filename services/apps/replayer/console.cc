#include "services/apps/replayer/console.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <thread>

#include "services/apps/replayer/keyframes.h"
#include "services/apps/replayer/published_difference.h"
#include "services/apps/replayer/replayed_node.h"
#include "services/apps/replayer/report_format.h"
#include "services/apps/replayer/session_facts.h"
#include "services/apps/replayer/tick_source.h"

namespace fulcrum::replay {
namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();

bool LineWaits() {
  pollfd wait{STDIN_FILENO, POLLIN, 0};
  return ::poll(&wait, 1, 0) > 0;
}

/// Reads a line of standard input byte by byte: bytes in a buffer would be missing in the keyframe process that
/// continues.
bool ReadLine(std::string* line) {
  line->clear();
  char c = 0;
  while (::read(STDIN_FILENO, &c, 1) == 1) {
    if (c == '\n') return true;
    line->push_back(c);
  }
  return !line->empty();
}

class Console {
 public:
  Console(const LockStepSettings& settings, const SceneView& scene, const config::CartConfig& cart,
          Keyframes* keyframes)
      : settings_(settings),
        scene_(scene),
        keyframes_(keyframes),
        rate_(settings.rate),
        source_(settings.recording, settings.nodes, NodePeriods(cart)) {
    for (const NodeId node : settings.nodes) {
      nodes_.emplace(node, MakeReplayedNode(node, {scene, cart, settings.folder, 1}));
    }
  }

  int Run() {
    std::string line;
    for (;;) {
      if (::isatty(STDIN_FILENO) != 0) std::cout << "replay> " << std::flush;
      if (!ReadLine(&line) || !Execute(line)) break;
      std::cout << std::flush;
    }
    return std::any_of(seen_.begin(), seen_.end(), [](const auto& node) { return node.second.differs; }) ? 1 : 0;
  }

 private:
  struct Seen {
    RecordedTick tick;
    std::uint64_t hash = 0, ticks = 0, compared = 0;
    bool differs = false;
  };

  /// Executes a command; false: end of the replay.
  bool Execute(const std::string& line) {
    std::istringstream words(line);
    std::string verb;
    double number = 0;
    words >> verb;
    const bool given = static_cast<bool>(words >> number);
    if (verb.empty()) return true;
    if (verb == "quit" || verb == "q") return false;
    if (verb == "go" || verb == "g") {
      Go(given ? number : kForever);
      Show();
    } else if (verb == "step" || verb == "s") {
      const int count = given ? std::max(1, static_cast<int>(number)) : 1;
      for (int i = 0; i < count && Advance(); ++i) {
      }
      Show();
    } else if (verb == "seek" && given) {
      Seek(number);
      Show();
    } else if (verb == "rate" && given && number >= 0) {
      rate_ = number;
    } else if (verb == "show") {
      Show();
    } else {
      PrintConsoleHelp(std::cout);
    }
    return true;
  }

  [[nodiscard]] double time_s() const { return next_ ? next_->tick.session_time_s : last_time_s_; }

  bool Peek() {
    if (next_) return true;
    RecordedTick tick;
    if (!source_.Next(&tick)) return false;
    RefuseOtherScene(settings_.recording, source_.session(), scene_);
    next_ = std::move(tick);
    return true;
  }

  /// Replays the next tick of any node; false at the end, or when the tick cannot be replayed.
  bool Advance() {
    if (!Peek()) {
      std::cout << "the recording ends here\n";
      return false;
    }
    if (const auto wanted = keyframes_->Keep(time_s())) {
      source_.Reopen();
      Go(*wanted, 0);
      // This is the process that "seek" has woken: the command in which its keyframe was made ends here.
      return false;
    }
    if (!next_->missing.empty()) {
      std::cout << next_->missing << '\n';
      return false;
    }
    Seen& seen = seen_[next_->node];
    ReplayedNode& node = *nodes_.at(next_->node);
    seen.hash = node.Step(*next_);
    ++seen.ticks;
    seen.tick = std::move(*next_);
    next_.reset();
    last_time_s_ = seen.tick.tick.session_time_s;
    if (!seen.tick.state_hash) return true;
    ++seen.compared;
    const bool differed = seen.differs;
    seen.differs = *seen.tick.state_hash != seen.hash;
    if (!seen.differs || differed) return true;
    std::cout << NodeName(seen.tick.node) << " differs from tick " << seen.tick.tick.index << " on: "
              << DescribeDifference(settings_.recording, seen.tick.epoch, seen.tick.tick.stamp_ns, node.TakeOutputs())
              << '\n';
    return false;
  }

  /// Replays until a session time, a line on standard input, or until Advance() returns false. At full speed only a
  /// person's line pauses: in a file the next command is always there.
  void Go(double until_s) { Go(until_s, rate_, rate_ > 0 || ::isatty(STDIN_FILENO) != 0); }
  void Go(double until_s, double rate, bool line_pauses = false) {
    using Clock = std::chrono::steady_clock;
    if (!Peek()) return;
    const auto begin = Clock::now();
    const double first_s = time_s();
    while (Peek() && time_s() < until_s && !(line_pauses && LineWaits())) {
      if (rate > 0) {
        std::this_thread::sleep_until(begin + std::chrono::duration_cast<Clock::duration>(
                                                  std::chrono::duration<double>((time_s() - first_s) / rate)));
      }
      if (!Advance()) return;
    }
  }

  void Seek(double wanted_s) {
    if (wanted_s < last_time_s_) {
      std::cout << std::flush;
      keyframes_->GoBack(wanted_s);
      std::cout << "no keyframe at or before " << wanted_s << " s\n";
      return;
    }
    Go(wanted_s, 0);
  }

  void Show() {
    for (const auto& [node, seen] : seen_) {
      std::cout << Format("%-14s tick %llu at %.3f s, state %016llx%s; %llu compared\n", NodeName(node),
                          static_cast<unsigned long long>(seen.tick.tick.index), seen.tick.tick.session_time_s,
                          static_cast<unsigned long long>(seen.hash),
                          !seen.tick.state_hash ? ""
                          : seen.differs        ? " DIFFERENT"
                                                : " as recorded",
                          static_cast<unsigned long long>(seen.compared));
    }
  }

  const LockStepSettings& settings_;
  const SceneView& scene_;
  Keyframes* keyframes_;
  double rate_, last_time_s_ = 0;
  TickSource source_;
  std::map<NodeId, std::unique_ptr<ReplayedNode>> nodes_;
  std::map<NodeId, Seen> seen_;
  std::optional<RecordedTick> next_;
};

}  // namespace

int RunConsole(const LockStepSettings& settings, const SceneView& scene, const config::CartConfig& cart) {
  return Keyframes::Run([&](Keyframes* keyframes) { return Console(settings, scene, cart, keyframes).Run(); });
}

void PrintConsoleHelp(std::ostream& out) {
  out << "go [S]      replay to session time S [s] (default: the end); Enter pauses\n"
         "step [N]    replay the next N ticks of all nodes in order (default: 1)\n"
         "seek S      go to session time S [s], forward as fast as possible, back to the nearest keyframe and forward\n"
         "rate X      speed of go as a multiple of real time; 0: as fast as possible\n"
         "show        print tick and time of each node, and whether its state equals the recorded one\n"
         "quit        end the replay\n";
}

}  // namespace fulcrum::replay
