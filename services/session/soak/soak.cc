#include "services/session/soak/soak.h"

#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/child_process.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/session/soak/process_table.h"
#include "services/session/soak/script_rounds.h"
#include "services/session/soak/soak_page.h"
#include "services/session/supervisor/flat_json.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/progress.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/session_view.h"

namespace fulcrum::soak {
namespace {

namespace fs = std::filesystem;
using runtime::MonotonicNs;
using supervisor::Fixed;

constexpr std::array kWatched{"handle_bridge", "haptics_node", "physics_node",
                              "thermal_node",  "render_node",  "recorder"};
/// The first kNodes of kWatched get blows.
constexpr std::size_t kNodes = 5;
constexpr double kStart_s = 60;    ///< Longest start of all nodes on a slow machine [s].
constexpr double kPause_s = 8;     ///< Mean time between blows [s]: each node dies about once in a minute and a half.
constexpr double kQuiet = 1 / 3.;  ///< Share of the session, at its end, without blows.
constexpr double kEnd_s = 60;      ///< Longest time from the end of the session time to that of `fulcrum up` [s].
constexpr std::int64_t kSample = kSecond_ns;
constexpr auto kTurn = std::chrono::milliseconds(20);

/// Reads every topic with physics and heat to count the samples that its gate refuses.
class Listener {
 public:
  explicit Listener(bus::DdsParticipant* participant)
      : tools_(participant->MakeInput<ToolState>()),
        frames_(participant->MakeInput<TissueFrame>()),
        models_(participant->MakeInput<ContactModel>()),
        contacts_(participant->MakeInput<CauteryContact>()),
        patches_(participant->MakeInput<TemperaturePatch>()),
        events_(participant->MakeInput<ThermalEvent>()) {}
  void Listen() {
    std::apply([](auto&... input) { (Drain(&input), ...); },
               std::tie(tools_, frames_, models_, contacts_, patches_, events_));
  }
  [[nodiscard]] std::uint64_t refused() const {
    return tools_->stats().rejected + frames_->stats().rejected + models_->stats().rejected +
           contacts_->stats().rejected + patches_->stats().rejected + events_->stats().rejected;
  }

 private:
  template <class T>
  static void Drain(std::unique_ptr<bus::Input<T>>* input) {
    static T sample;
    while ((*input)->TakeNext(&sample)) {
    }
  }
  std::unique_ptr<bus::Input<ToolState>> tools_;
  std::unique_ptr<bus::Input<TissueFrame>> frames_;
  std::unique_ptr<bus::Input<ContactModel>> models_;
  std::unique_ptr<bus::Input<CauteryContact>> contacts_;
  std::unique_ptr<bus::Input<TemperaturePatch>> patches_;
  std::unique_ptr<bus::Input<ThermalEvent>> events_;
};

class Soak {
 public:
  explicit Soak(const SoakSettings& settings) : settings_(settings), total_s_(60 * settings.minutes), progress_(false) {
    std::error_code error;
    folder_ = settings.out / "soak";
    fs::create_directories(folder_, error);
    if (error) throw InputError("--out " + settings.out.string() + ": " + error.message());
    log_ = folder_ / "up.log";
    fs::remove(log_, error);
    const fs::path scene = folder_ / "rounds.fulcrum";
    WriteSceneOfRounds(settings.scene, total_s_, scene);
    const fs::path cart = folder_ / "cart.yaml";
    supervisor::WriteFile(cart, config::CartToYaml(CartOf(settings)));
    std::vector<std::string> words{"up",        scene.string(),     "--out",    folder_.string(),
                                   "--seconds", Fixed(total_s_, 1), "--domain", std::to_string(settings.domain),
                                   "--cart",    cart.string()};
    words.insert(words.end(), settings.up.begin(), settings.up.end());
    up_ = runtime::ChildProcess::Start(settings.program, words, log_);
  }

  ExitCode Run() {
    WaitForNodes();
    if (settings_.chaos) {
      plan_ = PlanChaos(settings_.seed, nodes_, std::min(10.0, 0.1 * total_s_), (1 - kQuiet) * total_s_, kPause_s);
    }
    while (!ended_) {
      Turn();
      const double late_s = NowS() - total_s_;
      if (!asked_to_end_ && (runtime::ShouldStop() || late_s > kEnd_s)) {
        up_.Signal(SIGINT);
        asked_to_end_ = true;
      }
      if (late_s > 2 * kEnd_s) up_.Signal(SIGKILL);
      std::this_thread::sleep_for(kTurn);
    }
    for (std::thread& busy : crowd_) busy.join();
    return Conclude();
  }

 private:
  [[nodiscard]] double NowS() const {
    return begin_ns_ == 0 ? 0 : 1e-9 * static_cast<double>(MonotonicNs() - begin_ns_);
  }

  void WaitForNodes() {
    const std::int64_t patience_ns = MonotonicNs() + static_cast<std::int64_t>(kStart_s * kSecond_ns);
    for (bool all = false; !all;) {
      if (!view_ && supervisor::RunningSession(settings_.domain) != 0) {
        // It reads every topic, as a recorder does.
        listener_.emplace(&view_.emplace(settings_.domain, NodeName(NodeId::kRecorder)).participant());
      }
      Look();
      if (ended_) throw InputError("the session did not start; see " + log_.string());
      if (runtime::ShouldStop() || MonotonicNs() > patience_ns) {
        up_.Signal(SIGINT);
        throw InputError("not every node of the session ran within " + Fixed(kStart_s, 0) + " s; see " + log_.string());
      }
      all = view_ && view_->manifest().session_start_ns != 0 && !children_.empty();
      nodes_.clear();
      for (std::size_t i = 0; i < kNodes; ++i) {
        if (children_.count(kWatched[i]) == 0) continue;
        nodes_.emplace_back(kWatched[i]);
        all = all && view_->health(NodeOf(kWatched[i])).state == HealthState::kRunning;
      }
      std::this_thread::sleep_for(kTurn);
    }
    begin_ns_ = view_->manifest().session_start_ns;
    processors_ = ReadProcessorTimes();
    progress_.Say("soak: " + std::to_string(nodes_.size()) + " nodes run, " + Fixed(settings_.minutes, 1) + " min" +
                  (settings_.chaos ? " with blows" : ""));
  }

  /// Kills are part of the chaos, and who comes back from them is well.
  static config::CartConfig CartOf(const SoakSettings& settings) {
    config::CartConfig cart = settings.cart;
    if (settings.chaos) cart.verdict.restarts = config::kMostRestarts;
    return cart;
  }

  static NodeId NodeOf(const std::string& program) {
    for (std::size_t i = 0; i < kNodeCount; ++i) {
      const auto node = static_cast<NodeId>(i);
      if (program == NodeName(node)) return node;
    }
    throw InputError("no node is called " + program);
  }

  /// Reads the present processes, their Health, and whether the session has ended.
  void Look() {
    if (view_) view_->Update();
    if (listener_) listener_->Listen();
    children_ = ChildrenOf(up_.pid());
    if (const auto end = up_.Poll()) {
      ended_ = true;
      well_ = end->signal == 0 && end->exit_code == 0;
      if (!well_) verdict_ = "the session " + end->Describe() + "; see " + log_.string();
    }
  }

  void Turn() {
    Look();
    const double now_s = NowS();
    // At its end the session stops its nodes, which must not count as crashes.
    const bool over = ended_ || asked_to_end_ || now_s > total_s_ - 1;
    if (!over) {
      Judge(now_s);
      Strike(now_s);
    }
    if (!frozen_.empty() && now_s >= thaw_s_) Thaw();
    if (progress_.IsDue(MonotonicNs())) {
      progress_.Show(MonotonicNs(), Fixed(now_s / 60, 1) + " of " + Fixed(settings_.minutes, 1) + " min, " +
                                        std::to_string(record_.blows().size()) + " blows, " +
                                        std::to_string(record_.crashes()) + " crashes, memory +" +
                                        Fixed(record_.LargestGrowth_MB(), 1) + " MB");
    }
  }

  void Judge(double now_s) {
    std::vector<std::int32_t> alive{up_.pid()};
    const bool sample = MonotonicNs() >= next_sample_ns_;
    if (sample) next_sample_ns_ = MonotonicNs() + kSample;
    const auto look_at = [&](const std::string& program, pid_t process) {
      alive.push_back(process);
      if (!sample) return;
      if (const auto resident = ResidentBytes(process)) record_.AddMemory(now_s, program, process, *resident);
    };
    look_at("supervisor", up_.pid());
    for (const auto& [program, process] : children_) {
      if (std::find(kWatched.begin(), kWatched.end(), program) != kWatched.end()) look_at(program, process);
    }
    record_.SetAlive(alive);
    record_.SetRefused(listener_->refused());
    if (!sample) return;
    for (const std::string& node : nodes_) record_.AddHealth(now_s, view_->health(NodeOf(node)));
  }

  void Strike(double now_s) {
    if (next_blow_ == plan_.size() || now_s < plan_[next_blow_].time_s || !frozen_.empty()) return;
    Blow blow = plan_[next_blow_++];
    blow.time_s = now_s;
    if (blow.kind == BlowKind::kCrowd) {
      record_.AddBlow(blow, 0);
      Crowd(blow.length_s);
      return;
    }
    const auto victim = children_.find(blow.node);
    if (victim == children_.end()) return;  // It is being started again.
    // Recorded before the signal, so that the end of the process never counts as a crash.
    record_.AddBlow(blow, victim->second);
    if (blow.kind == BlowKind::kKill) {
      ::kill(victim->second, SIGKILL);
    } else {
      ::kill(victim->second, SIGSTOP);
      frozen_.push_back(victim->second);
      thaw_s_ = now_s + blow.length_s;
    }
  }

  void Thaw() {
    for (const pid_t process : frozen_) ::kill(process, SIGCONT);
    frozen_.clear();
  }

  void Crowd(double length_s) {
    for (std::thread& busy : crowd_) busy.join();
    crowd_.clear();
    const std::int64_t until_ns = MonotonicNs() + static_cast<std::int64_t>(length_s * kSecond_ns);
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i) {
      crowd_.emplace_back([until_ns] {
        while (MonotonicNs() < until_ns) {
        }
      });
    }
  }

  ExitCode Conclude() {
    const double duration_s = std::min(NowS(), total_s_);
    if (well_ && duration_s < total_s_ - 2) verdict_ = asked_to_end_ ? "ended early by a stop signal" : "ended early";
    const ProcessorTimes now = ReadProcessorTimes();
    if (now.all > processors_.all) {
      record_.SetStolen(100.0 * static_cast<double>(now.stolen - processors_.stolen) /
                        static_cast<double>(now.all - processors_.all));
    }
    record_.End(duration_s, well_ && (asked_to_end_ || verdict_.empty()), verdict_);
    const fs::path session = fs::exists(folder_ / "latest") ? fs::path("latest") : fs::path(".");
    supervisor::FlatJson json;
    json.Add("passed", record_.Passes(settings_.limits));
    json.Add("seed", static_cast<double>(settings_.seed));
    for (const SoakFigure& figure : FiguresOf(record_)) {
      std::printf("%s %.6g %s\n", figure.key, figure.value, figure.unit);
      json.Add(figure.key, figure.value);
    }
    supervisor::WriteFile(folder_ / "soak.json", json.text());
    supervisor::WriteFile(folder_ / "soak.html",
                          SoakPage(record_, settings_.limits, view_->manifest().scene_name, session));
    supervisor::WriteFile(folder_ / "samples.csv", SamplesCsv(record_));
    if (!verdict_.empty()) std::printf("! %s\n", verdict_.c_str());
    std::printf("%s: %s\n", record_.Passes(settings_.limits) ? "passed" : "FAILED", (folder_ / "soak.html").c_str());
    return record_.Passes(settings_.limits) ? ExitCode::kDone : ExitCode::kFailure;
  }

  SoakSettings settings_;
  double total_s_;
  fs::path folder_, log_;
  supervisor::Progress progress_;
  std::optional<supervisor::SessionView> view_;  ///< Set when the session has opened its bus.
  std::optional<Listener> listener_;
  runtime::ChildProcess up_;
  std::map<std::string, pid_t> children_;
  std::vector<std::string> nodes_;
  std::vector<Blow> plan_;
  ProcessorTimes processors_;
  std::size_t next_blow_ = 0;
  std::vector<pid_t> frozen_;
  double thaw_s_ = 0;
  std::vector<std::thread> crowd_;
  std::int64_t begin_ns_ = 0, next_sample_ns_ = 0;
  bool asked_to_end_ = false, ended_ = false, well_ = false;
  std::string verdict_;
  SoakRecord record_;
};

}  // namespace

ExitCode RunSoak(const SoakSettings& settings) { return Soak(settings).Run(); }

}  // namespace fulcrum::soak
