#include "services/session/supervisor/supervisor.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "services/base/core/tick.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/session/supervisor/command_desk.h"
#include "services/session/supervisor/crash_watch.h"
#include "services/session/supervisor/dump_trigger.h"
#include "services/session/supervisor/loop_wait.h"
#include "services/session/supervisor/node_orders.h"
#include "services/session/supervisor/node_process.h"
#include "services/session/supervisor/refusal_journal.h"
#include "services/session/supervisor/remote_nodes.h"
#include "services/session/supervisor/session_assessment.h"
#include "services/session/supervisor/session_clock.h"
#include "services/session/supervisor/session_end.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/session_generator.h"
#include "services/session/supervisor/session_nodes.h"
#include "services/session/supervisor/session_record.h"
#include "services/session/supervisor/session_setup.h"
#include "services/session/supervisor/session_status.h"
#include "services/session/supervisor/supervisor_health.h"
#include "services/session/supervisor/watch_times.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"

namespace fulcrum::supervisor {
namespace {

using runtime::MonotonicNs;

// Longest wait for the first Health of all nodes [ns]; the session then begins without the missing ones.
constexpr std::int64_t kLongestDelay_ns = 30 * kSecond_ns;
// From the publication of SceneManifest to session time 0 [ns], so that the manifest reaches all nodes before.
constexpr std::int64_t kLeadTime_ns = kSecond_ns / 5;

}  // namespace

struct Supervisor::Impl {
  explicit Impl(const UpSettings& up)
      : setup(up), crash_watch(up.cart.domain, setup.memory, setup.folder), status(!up.attach.empty()) {
    SweepKilledSessions(up.cart.domain);
    if (!setup.keys_warning.empty()) status.Say("! " + setup.keys_warning);
    for (const std::string& notice : setup.notices) status.Say("! " + notice);
    participant.emplace(bus::DdsSettings{.domain = up.cart.domain,
                                         .node_name = "supervisor",
                                         .shared_memory = setup.memory,
                                         .security = setup.security(),
                                         .tissue_vertices = static_cast<int>(setup.scene.view().rest_position.size())});
    manifests = participant->MakeOutput<SceneManifest>();
    generator.emplace(participant->MakeOutput<GeneratorSetting>(), up.cart.generator, setup.operator_script());
    healths = participant->MakeInput<Health>();
    own_health.emplace(participant->MakeOutput<Health>(), setup.scene.view().hash);
    events = participant->MakeInput<ThermalEvent>();
    orders.emplace(setup.memory);
    dumps.emplace(up.keep_s, setup.folder.path, &*orders);
    desk.emplace(setup.memory, *setup.guard, up.cart.security.group, Verbs());
    if (!setup.remote_ids.empty()) remote.emplace(setup, &*participant);
    if (setup.scene.view().assessment.on != 0) assessed.emplace(setup.scene.view(), &*participant);
    verdict.Begin(VerdictSession(setup));
    nodes.emplace(setup, [this](NodeId to, const char* verb) { orders->Send(to, verb); });
  }

  [[nodiscard]] bool IsOver() const { return ending || (setup.end_s > 0 && clock.At(MonotonicNs()) >= setup.end_s); }

  // ------------------------------------------------------------------------------------------------- commands

  std::vector<CommandDesk::Verb> Verbs() {
    using Text = const std::string&;
    return {{"restart", [this](Text node, std::int64_t now) { return Restart(node, now); }},
            {"swap", [this](Text node_and_words, std::int64_t now) { return nodes->Swap(node_and_words, now); }},
            {"generator", [this](Text words, std::int64_t now) { return generator->Turn(words, now); }},
            {"dump", [this](Text reason, std::int64_t now) { return dumps->OnCommand(reason, now); }},
            {"down", [this](Text, std::int64_t) { return Down(); }}};
  }

  CommandAnswer Restart(const std::string& name, std::int64_t now) {
    std::optional<CommandAnswer> answer = nodes->Restart(name, now);
    if (!answer && remote) answer = remote->Restart(name);
    return answer ? *answer : SessionNodes::NotRunning(name);
  }

  CommandAnswer Down() {
    ending = true;
    return {true, "ending the session"};
  }

  // ------------------------------------------------------------------------------------------ stages of the loop

  void TakeReports(std::int64_t now) {
    while (healths->TakeNext(&health)) TakeHealth(now);
    ThermalEvent event;
    while (events->TakeNext(&event)) {
      record.AddEvent(event);
      if (assessed) assessed->Add(event);
    }
    if (assessed) assessed->Take();
    EndOnMismatch(participant->schema_mismatch());
    TakeRefusals(now);
    if (remote) EndOnMismatch(remote->mismatch());
  }

  void TakeHealth(std::int64_t now) {
    for (const auto& node : nodes->all()) {
      if (!node->OnHealth(health, now)) continue;
      // Of a standby pair, only the leader's Health enters the record.
      const bool follows = setup.settings.standby && node->id() == NodeId::kPhysics &&
                           health.state != HealthState::kRunning && health.state != HealthState::kDegraded;
      // The record ends with the session: nodes then report peers that have just ended, which is no fault. What the
      // recorder cannot write of the end is one.
      if ((clock.stopped() && node->id() != NodeId::kRecorder) || follows) continue;
      const bool was_well = record.node(health.node).state != HealthState::kDegraded;
      record.AddHealth(clock.At(now), health);
      if (was_well && health.state == HealthState::kDegraded && !nodes->IsExcused(now)) DumpFault(now);
    }
    // The other host watches and restarts its nodes; here their Health is only recorded.
    const std::vector<NodeId>& far = setup.remote_ids;
    if (!clock.stopped() && std::find(far.begin(), far.end(), health.node) != far.end()) {
      record.AddHealth(clock.At(now), health);
    }
  }

  /// Requests a dump when a running node turns degraded: the newest seconds contain the cause.
  void DumpFault(std::int64_t now) {
    dumps->OnFault(std::string(NodeName(health.node)) + " is degraded" +
                       (health.last_error.empty() ? std::string() : ": " + health.last_error),
                   now);
  }

  void EndOnMismatch(const std::string& mismatch) {
    if (mismatch.empty()) return;
    verdict.Fail(clock.At(MonotonicNs()), ExitCode::kMismatch, mismatch);
    ending = true;
  }

  void TakeRefusals(std::int64_t now) {
    refusals.Take({participant->refusals(), remote ? remote->refusals() : bus::Refusals()},
                  [this](const std::string& text) { status.Say("! refused: " + text); });
    record.AddRefusals(clock.At(now), refusals.all());
  }

  void OnDeath(const SupervisedNode& node, const SupervisedNode::Death& death, std::int64_t now) {
    record.AddDeath(clock.At(death.at_ns != 0 ? death.at_ns : now), node.id(), death.cause, death.for_good,
                    death.asked);
    const UpSettings& up = setup.settings;
    const std::string what = std::string(NodeName(node.id())) + " " + death.cause;
    if (!death.asked) dumps->OnFault(what, now);
    if (!death.for_good) {
      status.Say("! " + what + (up.attach.empty() ? ": starting it again" : ""));
      return;
    }
    const std::string last = LastLine(node.command().log);
    status.Say("! " + what + ", for good; see " + node.log() + (last.empty() ? "" : "\n  " + last));
    // Without its recorder a running session goes on, and its verdict is a failure.
    if (!up.keep_going && (node.id() != NodeId::kRecorder || !clock.begun())) ending = true;
  }

  void FindFaults(std::int64_t now) {
    if (const SessionNodes::Failure& failure = nodes->failure(); failure.code != ExitCode::kDone) {
      verdict.Fail(clock.At(now), failure.code, failure.why);
    }
    verdict.Watch(clock.At(now), record);
    SayFaults();
  }

  /// Says each fault once.
  void SayFaults() {
    for (; faults_said < verdict.faults().size(); ++faults_said) {
      status.Say("! not well: " + verdict.faults()[faults_said].text);
    }
  }

  void PublishOwnHealth(std::int64_t now) {
    if (!own_health->IsDue(now)) return;
    const HealthState state = ending          ? HealthState::kStopping
                              : clock.begun() ? HealthState::kRunning
                                              : HealthState::kWaiting;
    Health own = own_health->Make(state, now);
    const GeneratorSetting& set = generator->setting();
    own.metrics = {{"session_time_s", clock.At(now)},
                   {"session_end_s", setup.end_s},
                   {"refused", static_cast<double>(refusals.all().count())},
                   {"open_bus", setup.settings.open_bus ? 1.0 : 0.0},
                   {"generator_cut_W", static_cast<double>(set.cut_W)},
                   {"generator_coag_W", static_cast<double>(set.coag_W)},
                   {"generator_blend_W", static_cast<double>(set.blend_W)}};
    for (const NodeId id : setup.node_ids) {
      own.metrics.push_back({std::string("restarts_") + NodeName(id), static_cast<double>(record.node(id).restarts)});
    }
    if (assessed && clock.begun()) assessed->AddTo(clock.At(now), &own);
    own.metrics.push_back({"faults", static_cast<double>(verdict.faults().size())});
    own.last_error = verdict.faults().empty() ? nodes->failure().why : verdict.faults().back().text;
    const std::vector<std::string>& refused = refusals.all().texts;
    if (own.last_error.empty() && !refused.empty()) own.last_error = "refused: " + refused.back();
    if (remote) remote->AddTo(&own);
    own_health->Write(&own);
  }

  void ShowProgress(std::int64_t now) {
    if (!status.IsDue(now)) return;
    std::string line = "starting";
    if (clock.begun()) {
      // A person does not follow the script.
      const std::string phase =
          setup.operator_script().empty() ? std::string() : PhaseAt(setup.scene.view(), clock.At(now));
      line = FiguresLine(phase, record, clock.At(now), setup.end_s);
      line += assessed ? assessed->Line(clock.At(now)) : "";
    }
    line += " · " + std::to_string(nodes->running()) + "/" + std::to_string(nodes->all().size()) + " nodes";
    status.Show(now, line);
  }

  void Turn() {
    const std::int64_t now = MonotonicNs();
    TakeReports(now);
    nodes->Watch(now, [&](const auto& node, const auto& death) { OnDeath(node, death, now); });
    NoteChildren();
    FindFaults(now);
    desk->Serve(now);
    generator->Follow(clock, now);
    PublishOwnHealth(now);
    ShowProgress(now);
    status.Update(now);
    ending |= runtime::ShouldStop();
    wait.Wait(desk->descriptors(), clock.begun() ? kSessionPeriod : kLoopPeriod);
  }

  /// Services end with the unit of the supervisor; systemd would restart one that is killed.
  void NoteChildren() {
    if (!setup.settings.attach.empty()) return;
    std::size_t place = 0;
    for (const auto& node : nodes->all()) crash_watch.Note(place++, node->pid());
  }

  // ---------------------------------------------------------------------------------------- phases of the session

  /// Waits until every node has reported, so that all are ready at session time 0.
  void WaitForNodes() {
    const std::int64_t begin = MonotonicNs();
    nodes->Start(begin);
    const UpSettings& up = setup.settings;
    if (!up.attach.empty()) PointTo(up.attach / "session", setup.folder.path);
    status.Ready();
    const auto seen = [this](NodeId node) { return record.node(node).seen; };
    const auto all_ready = [&] {
      return nodes->AreReady() && std::all_of(setup.remote_ids.begin(), setup.remote_ids.end(), seen);
    };
    while (!ending && !all_ready() && MonotonicNs() - begin < kLongestDelay_ns) Turn();
  }

  void BeginSession() {
    const std::int64_t now = MonotonicNs();
    clock.Begin(now + kLeadTime_ns);
    SceneManifest manifest;
    manifest.stamp = {1, static_cast<std::uint64_t>(now), now};
    manifest.scene_name = setup.scene.view().name;
    manifest.session_id = setup.folder.session_id;
    manifest.scene_hash = setup.scene.view().hash;
    manifest.session_start_ns = clock.start_ns();
    manifest.recorded = setup.has_recorder();
    if (assessed) assessed->Begin(clock.start_ns());
    if (!manifests->Write(manifest)) {
      verdict.Fail(0, ExitCode::kFailure, "the session could not be announced on the bus");
      ending = true;
    }
  }

  void EndNodes() {
    ending = true;
    TakeReports(MonotonicNs());
    clock.Stop(MonotonicNs());
    if (assessed) assessed->End(clock.reached_s());
    // Published at once: it marks the end of the session in a recording.
    own_health->MakeDue();
    PublishOwnHealth(MonotonicNs());
    if (remote) remote->SendBye();
    status.Stopping();
    nodes->End(
        [this](std::int64_t now) {
          TakeReports(now);
          PublishOwnHealth(now);
        },
        [this](const SupervisedNode& node, const char* done) {
          status.Say(std::string("! ") + NodeName(node.id()) + " did not end in time and " + done);
        });
  }

  /// The link leaves the bus first and the participant is destroyed last, because ports must not outlive it.
  void CleanUp() {
    remote.reset();
    desk.reset();
    orders.reset();
    events.reset();
    healths.reset();
    own_health.reset();
    manifests.reset();
    generator.reset();
    if (assessed) assessed->Close();
    participant.reset();
    bus::RemoveSharedMemory(setup.memory);
    std::error_code no_link;
    const UpSettings& up = setup.settings;
    if (!up.attach.empty()) std::filesystem::remove(up.attach / "session", no_link);
    RemoveCheckpoints(setup.folder);
    crash_watch.Done();
  }

  void Report() {
    Judge(setup, *nodes, record, clock.reached_s(), &verdict);
    SayFaults();
    const auto sheet = assessed ? std::optional(assessed->Finish()) : std::nullopt;
    SessionResults results = WriteResults(&setup, record, clock.reached_s(), sheet, &verdict);
    SayFaults();  // Of files that could not be written.
    status.Say(results.text);
    if (!HasVideo(setup)) return;
    setup.FreeDomain();
    status.Say("drawing the video of the session; Ctrl-C leaves it out");
    const auto goes_on = [this, signals = runtime::StopSignals()] {
      status.Update(runtime::MonotonicNs());
      return runtime::StopSignals() == signals;
    };
    status.Say(AddVideo(setup, record, goes_on, &results, &verdict));
    SayFaults();
  }

  SessionSetup setup;
  CrashWatch crash_watch;  ///< Begins before there are threads.
  LoopWait wait;

  std::optional<bus::DdsParticipant> participant;
  std::optional<RemoteNodes> remote;  ///< Empty: all nodes run here.
  std::unique_ptr<bus::Output<SceneManifest>> manifests;
  std::optional<SessionGenerator> generator;
  std::unique_ptr<bus::Input<Health>> healths;
  std::optional<SupervisorHealth> own_health;
  std::unique_ptr<bus::Input<ThermalEvent>> events;
  std::optional<NodeOrders> orders;
  std::optional<DumpTrigger> dumps;
  std::optional<CommandDesk> desk;
  std::optional<SessionAssessment> assessed;  ///< Set when the scene has the section `assessment`.
  std::optional<SessionNodes> nodes;

  SessionRecord record;
  SessionClock clock;
  SessionStatus status;
  RefusalJournal refusals;
  Verdict verdict;
  std::size_t faults_said = 0;
  Health health;        ///< Sample of TakeReports; a member so that its buffers are reused.
  bool ending = false;  ///< True: the loop stops after this turn.
};

Supervisor::Supervisor(const UpSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
Supervisor::~Supervisor() = default;

const std::filesystem::path& Supervisor::session_folder() const { return impl_->setup.folder.path; }

ExitCode Supervisor::Run() {
  Impl& session = *impl_;
  const SessionSetup& setup = session.setup;
  session.status.Say("session " + setup.folder.session_id + " in domain " + std::to_string(setup.settings.cart.domain));
  session.WaitForNodes();
  if (!session.ending) {
    session.BeginSession();
  }
  while (!session.IsOver()) session.Turn();
  session.EndNodes();
  session.CleanUp();
  session.Report();
  return session.verdict.code();
}

}  // namespace fulcrum::supervisor
