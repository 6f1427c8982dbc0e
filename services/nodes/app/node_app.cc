#include "services/nodes/app/node_app.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <limits>
#include <map>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/runtime/file_descriptor.h"
#include "services/base/runtime/realtime.h"
#include "services/base/runtime/service_notify.h"
#include "services/nodes/app/cart_security.h"
#include "services/nodes/app/health_report.h"
#include "services/nodes/app/longest_end.h"
#include "services/nodes/app/node_confinement.h"
#include "services/nodes/app/physics_rate.h"
#include "services/nodes/app/recorder_wait.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/control/control_socket.h"

namespace fulcrum::app {
namespace {

using runtime::Log;
using runtime::LogLevel;
using runtime::MonotonicNs;

constexpr std::int64_t kSessionUnknown = std::numeric_limits<std::int64_t>::max();
constexpr auto kPollPeriod = std::chrono::milliseconds(10);
/// During the session refusals and other scenes are looked for; orders and End() end the wait, a signal mostly.
constexpr auto kServePeriod = std::chrono::milliseconds(100);
/// Phase of a node's steps relative to multiples k of the session's period dt, in periods. Physics begins just after k
/// dt, when the ToolState of that time has arrived; thermal begins when the contact of that physics step has arrived.
constexpr double kPhysicsPhase = 0.12, kThermalPhase = 0.65;
constexpr auto kHealthPeriod = std::chrono::milliseconds(100);

/// Status text in `systemctl status`.
std::string StatusLine(const Health& health) {
  if (health.state == HealthState::kWaiting) return "waits for a session";
  std::array<char, 64> rate{};
  std::snprintf(rate.data(), rate.size(), "%s, %.1f of %.0f Hz", StateName(health.state),
                static_cast<double>(health.rate_achieved_Hz), static_cast<double>(health.rate_asked_Hz));
  return rate.data() + (health.last_error.empty() ? std::string() : "; " + health.last_error);
}

}  // namespace

struct NodeApp::Impl {
  Impl(NodeId node_id, const NodeOptions& node_options)
      : node(node_id),
        options(node_options),
        cart(node_options.cart.empty() ? config::CartConfig() : config::LoadCart(node_options.cart)),
        scene(node_options.scene) {}

  /// Participant and ports that every node has.
  struct Joined {
    explicit Joined(const bus::DdsSettings& settings)
        : participant(settings),
          manifests(participant.MakeInput<SceneManifest>()),
          healths(participant.MakeOutput<Health>()) {}

    bus::DdsParticipant participant;
    std::unique_ptr<bus::Input<SceneManifest>> manifests;
    std::unique_ptr<bus::OutputOf<Health>::type> healths;
    bus::Stamper health_stamper{MonotonicNs()};
  };
  Joined& Join() {
    if (!joined) {
      joined.emplace(bus::DdsSettings{.domain = options.domain,
                                      .node_name = NodeName(node),
                                      .security = SecurityOf(cart, memory, NodeName(node)),
                                      .tissue_vertices = options.scene.empty()
                                                             ? kMaxTissueVertices
                                                             : static_cast<int>(scene.view().rest_position.size())});
    }
    return *joined;
  }

  /// Processes the messages for every node; called on the main thread.
  void PollBus() {
    SceneManifest manifest;
    while (joined->manifests->TakeNext(&manifest)) {
      if (manifest.scene_hash != scene.view().hash) {
        End(ExitCode::kMismatch, "the session runs another scene (\"" + manifest.scene_name +
                                     "\"): stop it, or start this node with the scene of the session");
        return;
      }
      session_recorded = manifest.recorded;
      if (session_start_ns.exchange(manifest.session_start_ns, std::memory_order_relaxed) == kSessionUnknown) {
        Log(LogLevel::kInfo, "joined session " + manifest.session_id);
      }
    }
    if (const std::string mismatch = joined->participant.schema_mismatch(); !mismatch.empty()) {
      End(ExitCode::kMismatch, mismatch);
    }
    const bus::Refusals refusals = joined->participant.refusals();
    for (; refusals_told < refusals.texts.size(); ++refusals_told) {
      Log(LogLevel::kWarning, "refused: " + refusals.texts[refusals_told]);
    }
  }

  /// Executes an order of the supervisor. Throws InputError.
  [[nodiscard]] control::Reply Execute(const control::Request& order) const {
    const auto handler = handlers.find(order.verb);
    if (handler == handlers.end()) {
      throw InputError("unknown verb \"" + order.verb + "\"; " + NodeName(node) + " has: " + Verbs());
    }
    return {true, handler->second(order.argument)};
  }

  [[nodiscard]] std::string Verbs() const {
    std::string verbs;
    for (const auto& [verb, handler] : handlers) {
      verbs += verbs.empty() ? verb : ", " + verb;
    }
    return verbs;
  }

  void End(ExitCode code, std::string_view reason) {
    const std::lock_guard lock(end_mutex);
    if (ended.load(std::memory_order_relaxed)) return;
    Log(code == ExitCode::kDone ? LogLevel::kInfo : LogLevel::kError, reason);
    exit_code = code;
    ended.store(true, std::memory_order_release);  // Publishes exit_code.
    (void)::eventfd_write(end_event.get(), 1);
  }

  [[nodiscard]] bool ShouldEnd() const noexcept {
    return ended.load(std::memory_order_acquire) || runtime::ShouldStop();
  }

  [[nodiscard]] double SessionTime(std::int64_t stamp_ns) const noexcept {
    const std::int64_t start = session_start_ns.load(std::memory_order_relaxed);
    return start == kSessionUnknown ? -1.0 : 1e-9 * static_cast<double>(stamp_ns - start);
  }

  void RefuseUnknownOptions() const {
    if (!options.extra.empty()) throw InputError("unknown option \"" + options.extra.front() + "\"; see --help");
  }

  /// Runs one step on the cyclic thread. A step that throws ends the node.
  void Step(const Tick& clock_tick, const std::function<void(const Tick&)>& step) {
    if (ShouldEnd()) return;
    Tick tick = clock_tick;
    tick.session_time_s = SessionTime(tick.stamp_ns);
    try {
      step(tick);
    } catch (const std::bad_alloc&) {
      End(ExitCode::kFailure, "step failed: out of memory");
    } catch (const std::exception& error) {
      End(ExitCode::kFailure, std::string("step failed: ") + error.what());
    }
  }

  /// Runs on the health thread.
  void PublishHealthUntil(const std::stop_token& stop, HealthReport* report, const runtime::CyclicThread& steps,
                          const HealthFill& fill) {
    runtime::ServiceNotify service;
    auto next = std::chrono::steady_clock::now();
    for (bool first = true; !stop.stop_requested(); first = false) {
      const Health now = PublishHealth(report, steps, fill);
      if (first) service.Ready();
      std::vector<std::uint64_t> counters{polls.load(std::memory_order_relaxed)};
      if (stepping.load(std::memory_order_relaxed)) counters.push_back(now.ticks);
      service.Update(now.stamp.stamp_ns, counters, StatusLine(now));
      if (std::chrono::steady_clock::now() >= next) next += kHealthPeriod;
      std::unique_lock lock(health_mutex);
      health_wanted.wait_until(lock, stop, next, [this] { return std::exchange(health_now, false); });
    }
    service.Stopping();
  }

  void Poll() {
    PollBus();
    if (orders) orders->Serve([this](const control::Request& order) { return Execute(order); });
    polls.fetch_add(1, std::memory_order_relaxed);
  }

  /// Waits until session time 0 has passed and, in a recorded session, the recorder reads the topics of this node.
  void WaitForSession() {
    const bool replayable = node != NodeId::kRecorder && node != NodeId::kRender;
    std::optional<RecorderWait> recorder;
    if (replayable) recorder.emplace(&joined->participant);
    for (; !ShouldEnd(); std::this_thread::sleep_for(kPollPeriod)) {
      Poll();
      const bool known = session_start_ns.load(std::memory_order_relaxed) != kSessionUnknown;
      if (recorder) recorder->Update(MonotonicNs(), known);
      const bool awaits = recorder && session_recorded;
      if (!known || (awaits && !recorder->is_over()) || SessionTime(MonotonicNs()) < 0) continue;
      if (awaits && !recorder->is_read()) {
        Log(LogLevel::kWarning, "begins, but no recorder reads its samples: a replay will lack its first ticks");
      }
      return;
    }
  }

  void Begin(runtime::CyclicThread* steps, std::int64_t period_ns) {
    if (ShouldEnd()) return;
    state = HealthState::kRunning;
    const double phase = node == NodeId::kPhysics ? kPhysicsPhase : node == NodeId::kThermal ? kThermalPhase : -1;
    const std::int64_t start_ns = session_start_ns.load(std::memory_order_relaxed);
    steps->Start(phase < 0 ? 0 : start_ns + static_cast<std::int64_t>(phase * static_cast<double>(period_ns)));
    stepping.store(true, std::memory_order_relaxed);
  }

  void ServeUntilEnd() {
    while (!ShouldEnd()) {
      Poll();
      std::vector<int> awaited{end_event.get()};
      orders->AddDescriptors(&awaited);
      if (!ShouldEnd()) control::AwaitInput(awaited, kServePeriod);
    }
  }

  void EndThreads(runtime::CyclicThread* steps, std::jthread* health) {
    // SIGALRM's default action ends the process.
    ::alarm(static_cast<unsigned>(LongestEnd_s(node)));
    state = HealthState::kStopping;
    steps->Stop();
    health->request_stop();
    health->join();
  }

  Health PublishHealth(HealthReport* report, const runtime::CyclicThread& thread, const HealthFill& fill) {
    const std::int64_t now = MonotonicNs();
    Health health = report->Make(now, state.load(std::memory_order_relaxed), thread.stats(), inputs, outputs);
    health.stamp = joined->health_stamper.Next(now);
    if (fill) fill(&health);
    if (const std::uint64_t locks = bus::DdsParticipant::inherited_locks(); locks > 0) {
      health.metrics.push_back({"locks_inherited", static_cast<double>(locks)});
    }
    if (const std::uint64_t foreign = joined->participant.foreign_samples(); foreign > 0) {
      // A node may have counted those of a participant of its own.
      const auto counted = std::ranges::find(health.metrics, bus::kForeignMetric, &Metric::name);
      if (counted == health.metrics.end()) {
        health.metrics.push_back({bus::kForeignMetric, static_cast<double>(foreign)});
      } else {
        counted->value += static_cast<double>(foreign);
      }
    }
    FitToMessage(&health);
    joined->healths->Write(health);
    return health;
  }

  const NodeId node;
  NodeOptions options;
  config::CartConfig cart;
  scene::SceneFile scene;
  const std::filesystem::path memory = bus::SharedMemoryDirectory(options.domain);
  std::optional<Joined> joined;
  std::optional<control::Server> orders;  ///< Of the supervisor.
  std::vector<HealthReport::InputWatch> inputs;
  std::vector<HealthReport::OutputWatch> outputs;
  std::vector<std::shared_ptr<void>> ports;
  std::map<std::string, std::function<std::string(const std::string&)>> handlers{
      {"stop",
       [this](const std::string&) {
         End(ExitCode::kDone, "stopped by order");
         return "stopping";
       }},
      {"restart", [this](const std::string&) {
         // The exit code of a failure makes the parent process restart the node.
         End(ExitCode::kFailure, "exits to be restarted");
         return "restarting";
       }}};

  std::size_t refusals_told = 0;
  bool session_recorded = false;
  // Relaxed: a single number that publishes no other data.
  std::atomic<std::int64_t> session_start_ns{kSessionUnknown};
  std::atomic<HealthState> state{HealthState::kStarting};
  std::mutex health_mutex;
  std::condition_variable_any health_wanted;
  bool health_now = false;
  std::atomic<std::uint64_t> polls{0};  ///< Cycles of the main thread.
  std::atomic<bool> stepping{false};
  std::mutex end_mutex;
  std::atomic<bool> ended{false};
  const runtime::FileDescriptor end_event{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};  ///< Can be read once it ends.
  ExitCode exit_code = ExitCode::kDone;
};

NodeApp::NodeApp(NodeId node, const NodeOptions& options) {
  std::error_code error;
  if (!std::filesystem::is_directory(options.session, error)) {
    throw InputError("--session " + options.session.string() + ": no such folder");
  }
  impl_ = std::make_unique<Impl>(node, options);
  if (node == NodeId::kPhysics) CheckPhysicsRate(scene(), cart());
}
NodeApp::~NodeApp() = default;

const SceneView& NodeApp::scene() const { return impl_->scene.view(); }
NodeOptions& NodeApp::options() { return impl_->options; }
const config::CartConfig& NodeApp::cart() const { return impl_->cart; }
bus::DdsParticipant& NodeApp::bus() { return impl_->Join().participant; }

runtime::CyclicThreadSettings NodeApp::timing() const {
  const config::NodeTiming& timing = impl_->cart.timing(impl_->node);
  runtime::CyclicThreadSettings settings;
  settings.name = NodeName(impl_->node);
  settings.period_ns = std::llround(1e9 / timing.rate_Hz);
  settings.fifo_priority = timing.fifo_priority;
  settings.spin_ns = std::llround(1e9 * timing.spin_s);
  settings.cpu = timing.cpu;
  return settings;
}

void NodeApp::Watch(TopicId topic, std::function<bus::InputStats()> stats) {
  impl_->inputs.emplace_back(topic, std::move(stats));
}
void NodeApp::Watch(std::function<bus::OutputStats()> stats) { impl_->outputs.push_back(std::move(stats)); }
void NodeApp::Keep(std::shared_ptr<void> port) { impl_->ports.push_back(std::move(port)); }

double NodeApp::SessionTime(std::int64_t stamp_ns) const noexcept { return impl_->SessionTime(stamp_ns); }

void NodeApp::OnOrder(std::string verb, std::function<std::string(const std::string&)> handler) {
  impl_->handlers[std::move(verb)] = std::move(handler);
}

void NodeApp::PublishHealthNow() {
  {
    const std::lock_guard lock(impl_->health_mutex);
    impl_->health_now = true;
  }
  impl_->health_wanted.notify_one();
}

void NodeApp::Finish(ExitCode code, std::string_view reason) { impl_->End(code, reason); }

ExitCode NodeApp::Run(const runtime::CyclicThreadSettings& settings, const std::function<void(const Tick&)>& step,
                      const HealthFill& fill_health) {
  Impl& app = *impl_;
  app.Join();
  app.RefuseUnknownOptions();
  app.orders.emplace(control::SocketOf(app.memory, NodeName(app.node)));
  runtime::CyclicThread steps(settings, [&](const Tick& tick) { app.Step(tick, step); });
  HealthReport report(app.node, settings.period_ns, bus::SchemaHash(), app.scene.view().hash, ::getpid());
  app.state = HealthState::kWaiting;
  std::jthread health([&](const std::stop_token& stop) { app.PublishHealthUntil(stop, &report, steps, fill_health); });

  app.WaitForSession();
  app.Begin(&steps, settings.period_ns);
  app.ServeUntilEnd();
  app.EndThreads(&steps, &health);
  app.PublishHealth(&report, steps, fill_health);
  return app.exit_code;
}

void LogCheckpoint(const runtime::CheckpointFile& checkpoint, bool restored) {
  if (!checkpoint.complaint().empty()) Log(LogLevel::kWarning, checkpoint.complaint());
  if (restored) {
    Log(LogLevel::kInfo, "goes on from its checkpoint");
  } else if (checkpoint.Latest()) {
    Log(LogLevel::kWarning, "its checkpoint contains values that this node cannot have written: begins anew");
  }
}

int NodeMain(int argc, char** argv, NodeId node, const char* description,
             const std::function<ExitCode(NodeApp&)>& run) {
  runtime::SetLogName(NodeName(node));
  runtime::InstallStopSignals();
  runtime::InstallLastWords();
  const auto fail = [](ExitCode code, const std::exception& error) {
    Log(LogLevel::kError, error.what());
    return static_cast<int>(code);
  };
  try {
    const ParsedOptions parsed = ParseNodeOptions(argc, argv, node, description);
    if (!parsed.answer.empty()) {
      std::fputs(parsed.answer.c_str(), stdout);
      return static_cast<int>(ExitCode::kDone);
    }
    NodeApp app(node, parsed.options);
    ConfineNode(node, parsed.options, app.cart());
    return static_cast<int>(run(app));
  } catch (const InputError& error) {
    return fail(ExitCode::kBadUsage, error);
  } catch (const MismatchError& error) {
    return fail(ExitCode::kMismatch, error);
  } catch (const std::bad_alloc&) {
    return fail(ExitCode::kFailure, std::runtime_error("out of memory" + runtime::AddressSpaceHint()));
  } catch (const std::system_error& error) {
    return fail(ExitCode::kFailure, std::runtime_error(error.what() + runtime::AddressSpaceHint()));
  } catch (const std::exception& error) {
    return fail(ExitCode::kFailure, error);
  }
}

}  // namespace fulcrum::app
