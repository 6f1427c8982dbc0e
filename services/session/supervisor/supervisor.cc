#include "services/session/supervisor/supervisor.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <deque>
#include <optional>
#include <span>
#include <sstream>
#include <thread>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/core/tick.h"
#include "services/base/runtime/realtime.h"
#include "services/base/runtime/service_notify.h"
#include "services/nodes/app/cart_security.h"
#include "services/nodes/app/health_report.h"
#include "services/records/recording/free_name.h"
#include "services/scene/format/scene_file.h"
#include "services/session/supervisor/attached_node.h"
#include "services/session/supervisor/clip.h"
#include "services/session/supervisor/cut_map_file.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/session/supervisor/generator_panel.h"
#include "services/session/supervisor/node_process.h"
#include "services/session/supervisor/node_starter.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/progress.h"
#include "services/session/supervisor/report.h"
#include "services/session/supervisor/score_sheet.h"
#include "services/session/supervisor/script_outlook.h"
#include "services/session/supervisor/session_assessment.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/session_keys.h"
#include "services/session/supervisor/session_record.h"
#include "services/session/supervisor/training_log.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/link/health.h"
#include "services/transport/link/link.h"
#include "services/transport/link/options.h"
#include "services/transport/link/scene_transfer.h"

namespace fulcrum::supervisor {
namespace {

using runtime::MonotonicNs;

constexpr auto kLoopPeriod = std::chrono::milliseconds(5);
constexpr std::int64_t kHealthPeriod = kSecond_ns / 10;
// A node that cannot start holds the session up no longer than this; it is then missing from the beginning.
constexpr std::int64_t kLongestStart = 30 * kSecond_ns;
// The manifest reaches all nodes before session time 0.
constexpr std::int64_t kLeadTime = kSecond_ns / 5;
// A dead process's files lose their names only: who has them open keeps them until its lease is over.
constexpr std::int64_t kSweepAfter = 2 * kSecond_ns;
// A gap in our own loop: a suspended machine, a stopped supervisor. Then silence proves nothing.
constexpr std::int64_t kHeldUp = kSecond_ns;
// What a node says of a peer that is being restarted by command is no fault.
constexpr std::int64_t kAskedFor = 3 * kSecond_ns;
// Commands whose askers may not have heard the answer yet.
constexpr std::size_t kAnswersKept = 8;

bool HasRecorder(const UpSettings& settings) { return settings.record || settings.keep_s > 0; }

std::vector<NodeId> NodesOf(const SceneView& scene, const UpSettings& settings) {
  std::vector<NodeId> nodes;
  for (int i = 0; i < kNodeCount; ++i) {
    const auto id = static_cast<NodeId>(i);
    if (id != NodeId::kSupervisor && (scene.node_mask >> i & 1u) != 0 && (settings.remote >> i & 1u) == 0) {
      nodes.push_back(id);
    }
  }
  if (nodes.empty()) {
    throw InputError(settings.scene.string() + ": the scene names no node to start here");
  }
  if (HasRecorder(settings)) {
    nodes.push_back(NodeId::kRecorder);
  }
  return nodes;
}

/// Those of the scene that run on another host.
std::vector<NodeId> RemoteNodesOf(const SceneView& scene, const UpSettings& settings) {
  std::vector<NodeId> nodes;
  for (int i = 0; i < kNodeCount; ++i) {
    if ((scene.node_mask & settings.remote) >> i & 1u) nodes.push_back(static_cast<NodeId>(i));
  }
  return nodes;
}

double EndOfSession(const UpSettings& settings, const SceneView& scene) {
  return settings.seconds >= 0 ? settings.seconds : static_cast<double>(scene.script_duration_s);
}

std::string RunYaml(const UpSettings& settings, double end_s) {
  const auto yes_no = [](bool value) { return value ? "true" : "false"; };
  return "  seconds: " + (end_s > 0 ? Fixed(end_s, 3) : std::string("until stopped")) +
         "\n  domain: " + std::to_string(settings.cart.domain) + "\n  window: " + yes_no(settings.window) +
         "\n  keep_going: " + yes_no(settings.keep_going) + "\n  standby: " + yes_no(settings.standby) +
         "\n  record: " + yes_no(settings.record.has_value()) +
         (settings.remote != 0 ? "\n  peer: " + settings.peer + "\n  remote: " + link::NamesOfNodes(settings.remote)
                               : "") +
         "\n";
}

/// The script that sets the generator: none on a cart with a real pedal, where a person operates it.
std::span<const ScriptKey> OperatorScript(const UpSettings& settings, const SceneView& scene) {
  return settings.cart.pedal.kind == config::LinkKind::kSimulated ? scene.script : std::span<const ScriptKey>();
}

bus::Security SecurityOf(const config::CartConfig& cart) {
  return app::SecurityOf(cart, NodeName(NodeId::kSupervisor));
}

std::filesystem::path RecordingFile(const UpSettings& settings, const SessionFolder& folder) {
  if (!settings.record) {
    return {};
  }
  const std::filesystem::path& wanted = *settings.record;
  return recording::FreeName(wanted.empty()                          ? folder.path / "recording.mcap"
                             : std::filesystem::is_directory(wanted) ? wanted / (folder.session_id + ".mcap")
                                                                     : wanted);
}

}  // namespace

struct Supervisor::Impl {
  explicit Impl(const UpSettings& up)
      : settings(up),
        scene(up.scene),
        end_s(EndOfSession(up, scene.view())),
        keys_warning(CheckSessionKeys(up.cart, NodesOf(scene.view(), up), std::time(nullptr))),
        guard(up.cart.domain),
        memory(bus::OpenSharedMemory(up.cart.domain, SecurityOf(up.cart))),
        training(OpenTrainingLog(up.trainee, up.training_database, scene.view())),
        folder(MakeSessionFolder(up.out, up.scene, scene, up.cart, RunYaml(up, end_s))),
        recording(RecordingFile(up, folder)),
        starter{settings, folder, recording},
        node_ids(NodesOf(scene.view(), up)),
        remote_ids(RemoteNodesOf(scene.view(), up)),
        generator(up.cart.generator, OperatorScript(up, scene.view())) {
    if (!keys_warning.empty()) progress.Say("! " + keys_warning);
    participant.emplace(bus::DdsSettings{
        .domain = up.cart.domain, .node_name = "supervisor", .shared_memory = memory, .security = SecurityOf(up.cart)});
    manifests = participant->MakeOutput<SceneManifest>();
    generator_out = participant->MakeOutput<GeneratorSetting>();
    PublishGenerator(MonotonicNs());
    healths_in = participant->MakeInput<Health>();
    healths_out = participant->MakeOutput<Health>();
    events = participant->MakeInput<ThermalEvent>();
    commands = participant->MakeInput<Command>();
    orders = participant->MakeOutput<Command>();
    replies = participant->MakeOutput<CommandReply>();
    if (!remote_ids.empty()) {
      link.emplace(link::LinkSettings{.far = FarOf(up), .offer = MakeOffer(), .scene = folder.scene});
      bus::DdsParticipant* bus = &*participant;
      if (!up.cart.security.keys.empty()) {
        // What others own is not the supervisor's to write.
        bus = &link_bus.emplace(bus::DdsSettings{.domain = up.cart.domain,
                                                 .node_name = "link",
                                                 .shared_memory = memory,
                                                 .security = app::SecurityOf(up.cart, bus::kLinkIdentity)});
      }
      link->Join(bus, link->settings().offer->nodes);
    }
    if (scene.view().assessment.on != 0) {
      assessed.emplace(scene.view(), &*participant);
    }
    for (const NodeId id : node_ids) {
      if (!up.attach.empty()) {
        nodes.push_back(std::make_unique<AttachedNode>(starter.Usual(id), folder.path / AttachedNode::kFolder,
                                                       [this](NodeId to, const char* verb) { Order(to, verb, ""); }));
      } else if (id == NodeId::kPhysics && up.standby) {
        nodes.push_back(std::make_unique<NodeProcess>(starter.InPair("a", false)));
        nodes.push_back(std::make_unique<NodeProcess>(starter.InPair("b", true)));
      } else {
        nodes.push_back(std::make_unique<NodeProcess>(starter.Usual(id)));
      }
    }
  }

  static bus::FarSettings FarOf(const UpSettings& up) {
    bus::FarSettings far =
        link::FarSettingsFor(bus::FarSide::kCart, up.peer, up.address, up.cart.domain, up.link_domain);
    far.keys = up.cart.security.keys;
    return far;
  }

  /// What the other host is to do.
  [[nodiscard]] link::Offer MakeOffer() const {
    const link::FileFacts facts = link::FactsOf(folder.scene);
    link::Offer offer;
    offer.session_id = folder.session_id;
    offer.scene_name = scene.view().name;
    offer.scene_hash = scene.view().hash;
    offer.scene_B = facts.size_B;
    offer.scene_checksum = facts.checksum;
    for (const NodeId node : remote_ids) offer.nodes |= 1u << static_cast<unsigned>(node);
    offer.cart_yaml = config::CartToYaml(settings.cart);
    return offer;
  }

  [[nodiscard]] double SessionTime(std::int64_t now) const {
    if (ended) {
      return reached_s;
    }
    return start_ns == 0 ? -1.0 : 1e-9 * static_cast<double>(now - start_ns);
  }
  [[nodiscard]] double ReachedTime() const { return std::max(0.0, SessionTime(MonotonicNs())); }

  SupervisedNode* Find(std::string_view name) {
    const auto found =
        std::find_if(nodes.begin(), nodes.end(), [&](const auto& node) { return name == NodeName(node->id()); });
    return found == nodes.end() ? nullptr : found->get();
  }

  const NodeId* FindRemote(std::string_view name) const {
    const auto found =
        std::find_if(remote_ids.begin(), remote_ids.end(), [&](NodeId node) { return name == NodeName(node); });
    return found == remote_ids.end() ? nullptr : &*found;
  }

  /// Ends the session; the first cause counts.
  void Fail(ExitCode code, const std::string& why) {
    if (exit_code == ExitCode::kDone) {
      exit_code = code;
      verdict = why;
    }
  }

  // ------------------------------------------------------------------------------------------ stages of the loop

  void WatchNodes(std::int64_t now) {
    if (now - last_loop_ns > kHeldUp) {
      for (const auto& node : nodes) {
        node->ForgiveSilence(now);
      }
    }
    last_loop_ns = now;
    for (const auto& entry : nodes) {
      SupervisedNode& node = *entry;
      const std::optional<SupervisedNode::Death> death = node.Update(now);
      if (!death) {
        continue;
      }
      sweep_ns = now + kSweepAfter;
      record.AddDeath(SessionTime(death->at_ns != 0 ? death->at_ns : now), node.id(), death->cause, death->for_good);
      const std::string what = std::string(NodeName(node.id())) + " " + death->cause;
      if (!death->asked) {
        AskDump(now, what);
      }
      if (!death->for_good) {
        progress.Say("! " + what + (settings.attach.empty() ? ": starting it again" : ""));
        continue;
      }
      const std::string last = LastLine(node.command().log);
      progress.Say("! " + what + ", for good; see " + node.log() + (last.empty() ? "" : "\n  " + last));
      const bool own_code = death->end.signal == 0 && death->end.exit_code >= 2 && death->end.exit_code <= 4;
      failed_code = own_code ? static_cast<ExitCode>(death->end.exit_code) : ExitCode::kFailure;
      failed_why = what + ", for good";
      // A session that runs goes on without its recorder: it is then not well, but not lost.
      if (!settings.keep_going && (node.id() != NodeId::kRecorder || start_ns == 0)) {
        ending = true;
      }
    }
    if (sweep_ns != 0 && now >= sweep_ns) {
      sweep_ns = 0;
      bus::SweepSharedMemory(memory);
    }
  }

  /// The last seconds to a file, unless one was written that shows them.
  void AskDump(std::int64_t now, const std::string& reason) {
    if (settings.keep_s <= 0 || now < next_dump_ns) {
      return;
    }
    next_dump_ns = now + static_cast<std::int64_t>(1e9 * settings.keep_s);
    Order(NodeId::kRecorder, "dump", reason);
  }

  void Order(NodeId target, const char* verb, const std::string& argument) {
    const std::int64_t now = MonotonicNs();
    Command order;
    order.stamp = order_stamper.Next(now);
    order.request_id = static_cast<std::uint64_t>(now);
    order.target = target;
    order.verb = verb;
    order.argument = argument;
    orders->Write(order);
  }

  /// A node that goes on, but no longer well: what led to it is in the newest past.
  void DumpFault(std::int64_t now) {
    AskDump(now, std::string(NodeName(health.node)) + " is degraded" +
                     (health.last_error.empty() ? std::string() : ": " + health.last_error));
  }

  void TakeReports(std::int64_t now) {
    while (healths_in->TakeNext(&health)) {
      for (const auto& node : nodes) {
        if (node->OnHealth(health, now)) {
          // Of a pair the leader's counts.
          const bool follows = settings.standby && node->id() == NodeId::kPhysics &&
                               health.state != HealthState::kRunning && health.state != HealthState::kDegraded;
          // The record closes with the session: what a node says of peers that have just ended is no finding.
          if (!ended && !follows) {
            const bool was_well = record.node(health.node).state != HealthState::kDegraded;
            record.AddHealth(SessionTime(now), health);
            if (was_well && health.state == HealthState::kDegraded && now >= excused_ns) DumpFault(now);
          }
        }
      }
      // Of the other host: watched and started again there.
      if (!ended && std::find(remote_ids.begin(), remote_ids.end(), health.node) != remote_ids.end()) {
        record.AddHealth(SessionTime(now), health);
      }
    }
    ThermalEvent event;
    while (events->TakeNext(&event)) {
      record.AddEvent(event);
      if (assessed) assessed->Add(event);
    }
    if (assessed) assessed->Take();
    if (const std::string mismatch = participant->schema_mismatch(); !mismatch.empty()) {
      Fail(ExitCode::kMismatch, mismatch);
      ending = true;
    }
    TakeRefusals(now);
    if (const std::string mismatch = link ? link->mismatch() : std::string(); !mismatch.empty()) {
      Fail(ExitCode::kMismatch, mismatch);
      ending = true;
    }
  }

  /// Of the bus and of the link, in the order in which they were told.
  void TakeRefusals(std::int64_t now) {
    const std::array<bus::Refusals, 2> sources{participant->refusals(), link ? link->refusals() : bus::Refusals()};
    refusals.participants = refusals.endpoints = 0;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      refusals.participants += sources[i].participants;
      refusals.endpoints += sources[i].endpoints;
      for (; refusals_told[i] < sources[i].texts.size(); ++refusals_told[i]) {
        refusals.texts.push_back(sources[i].texts[refusals_told[i]]);
        progress.Say("! refused: " + refusals.texts.back());
      }
    }
    record.AddRefusals(SessionTime(now), refusals);
  }

  void TakeCommands(std::int64_t now) {
    Command command;
    while (commands->TakeNext(&command)) {
      if (command.target != NodeId::kSupervisor) {
        continue;
      }
      // Who hears no answer asks again: done once, answered each time.
      const auto same = [&](const CommandReply& past) { return past.request_id == command.request_id; };
      if (const auto past = std::find_if(answered.begin(), answered.end(), same); past != answered.end()) {
        past->stamp = reply_stamper.Next(now);
        replies->Write(*past);
        continue;
      }
      CommandReply reply;
      reply.stamp = reply_stamper.Next(now);
      reply.request_id = command.request_id;
      reply.from_node = NodeId::kSupervisor;
      reply.ok = true;
      if (command.verb == "down") {
        reply.text = "ending the session";
        ending = true;
      } else if (command.verb == "dump") {
        next_dump_ns = 0;
        reply.ok = settings.keep_s > 0;
        reply.text = reply.ok ? "writing the last seconds into " + folder.path.string()
                              : "this session keeps no past: start it with fulcrum up --keep-last";
        AskDump(now, command.argument);
      } else if (command.verb == "restart") {
        SupervisedNode* node = Find(command.argument);
        if (node != nullptr && node->running()) {
          reply.text = "restarting " + command.argument + " (pid " + std::to_string(node->pid()) + ")";
          node->AskRestart(now);
          excused_ns = now + kAskedFor;
        } else if (const NodeId* remote = FindRemote(command.argument); remote != nullptr) {
          reply.text = "asking " + command.argument + " on " + settings.peer + " to end: it is started again there";
          Command stop;
          stop.stamp = order_stamper.Next(now);
          stop.request_id = static_cast<std::uint64_t>(now);
          stop.target = *remote;
          stop.verb = "stop";
          orders->Write(stop);
        } else {
          reply.ok = false;
          reply.text = "no running node \"" + command.argument + "\" in this session";
        }
      } else if (command.verb == "swap") {
        reply.ok = Swap(command.argument, now, &reply.text);
      } else if (command.verb == "generator") {
        reply.ok = TurnGenerator(command.argument, now, &reply.text);
      } else {
        reply.ok = false;
        reply.text =
            "unknown verb \"" + command.verb + "\"; the supervisor knows: restart, swap, generator, dump, down";
      }
      replies->Write(reply);
      if (answered.size() == kAnswersKept) answered.pop_front();
      answered.push_back(reply);
    }
  }

  bool TurnGenerator(const std::string& words, std::int64_t now, std::string* text) {
    try {
      generator.Turn(words);
    } catch (const InputError& error) {
      *text = error.what();
      return false;
    }
    if (!words.empty()) PublishGenerator(now);
    *text = "generator: " + generator.Text();
    return true;
  }

  /// @param from_ns since when the knobs are where they are.
  void PublishGenerator(std::int64_t from_ns) {
    // Readers take settings in the order of their stamps.
    setting_ns = std::max(from_ns, setting_ns + 1);
    GeneratorSetting setting = generator.setting();
    setting.stamp = setting_stamper.Next(setting_ns);
    generator_out->Write(setting);
  }

  void FollowScriptOfGenerator(std::int64_t now) {
    if (start_ns == 0 || !generator.Follow(SessionTime(now))) return;
    PublishGenerator(start_ns + static_cast<std::int64_t>(1e9 * generator.turned_s()));
  }

  /// @param argument the node, then the words of the command, a line each.
  bool Swap(const std::string& argument, std::int64_t now, std::string* answer) {
    std::vector<std::string> words;
    std::istringstream lines(argument);
    for (std::string word; std::getline(lines, word);) words.push_back(std::move(word));
    const std::string name = words.empty() ? std::string() : words.front();
    SupervisedNode* node = Find(name);
    if (node == nullptr || !node->running()) {
      *answer = "no running node \"" + name + "\" in this session";
      return false;
    }
    try {
      words.erase(words.begin());
      NodeCommand command = starter.Replacement(node->command(), words);
      *answer = "replacing " + name + " (pid " + std::to_string(node->pid()) + ") by " + command.program.string();
      node->Swap(std::move(command), now);
      excused_ns = now + kAskedFor;
      return true;
    } catch (const InputError& error) {
      *answer = error.what();
      return false;
    }
  }

  void PublishOwnHealth(std::int64_t now) {
    if (now < next_health_ns) {
      return;
    }
    next_health_ns = now + kHealthPeriod;
    Health own;
    own.stamp = health_stamper.Next(now);
    own.node = NodeId::kSupervisor;
    own.state = ending ? HealthState::kStopping : start_ns == 0 ? HealthState::kWaiting : HealthState::kRunning;
    own.pid = ::getpid();
    own.schema_hash = bus::SchemaHash();
    own.scene_hash = scene.view().hash;
    own.rate_asked_Hz = 1e9f / static_cast<float>(kHealthPeriod);
    own.rate_achieved_Hz = static_cast<float>(own_rate.Observe(now, ++own_ticks));
    own.ticks = own_ticks;
    own.metrics.push_back({"session_time_s", SessionTime(now)});
    own.metrics.push_back({"session_end_s", end_s});
    own.metrics.push_back({"refused", static_cast<double>(refusals.count())});
    own.metrics.push_back({"generator_cut_W", static_cast<double>(generator.setting().cut_W)});
    own.metrics.push_back({"generator_coag_W", static_cast<double>(generator.setting().coag_W)});
    own.metrics.push_back({"generator_blend_W", static_cast<double>(generator.setting().blend_W)});
    for (const NodeId id : node_ids) {
      own.metrics.push_back({std::string("restarts_") + NodeName(id), static_cast<double>(record.node(id).restarts)});
    }
    if (assessed && start_ns != 0) {
      assessed->AddTo(SessionTime(now), &own);
    }
    own.last_error = failed_why.empty() && !refusals.texts.empty() ? "refused: " + refusals.texts.back() : failed_why;
    if (link) {
      link::FillHealth(link->status(), &own);
    }
    app::FitToMessage(&own);
    healths_out->Write(own);
  }

  void ShowProgress(std::int64_t now) {
    if (!progress.IsDue(now)) {
      return;
    }
    const auto alive = std::count_if(nodes.begin(), nodes.end(), [](const auto& node) { return node->running(); });
    std::string line = start_ns == 0 ? "starting" : "t " + Fixed(std::max(0.0, SessionTime(now)), 1);
    if (start_ns != 0) {
      const std::string phase = PhaseAt(scene.view(), SessionTime(now));
      const auto last = [&](const char* metric) { return record.last(metric); };
      line += (end_s > 0 ? " / " + Fixed(end_s, 1) : std::string()) + " s";
      line += phase.empty() ? "" : " · " + phase;
      line += " · force " + Fixed(std::max(last("force0_N"), last("force1_N")), 2) + " N · displaced " +
              Fixed(last("displacement_mm"), 1) + " mm · " + Fixed(last("temperature_C"), 0) + " °C · cut " +
              Fixed(last("cut_length_mm"), 1) + " mm";
      line += assessed ? assessed->Line(SessionTime(now)) : "";
    }
    line += " · " + std::to_string(alive) + "/" + std::to_string(nodes.size()) + " nodes";
    service_status = line;
    progress.Show(now, line);
  }

  void Turn() {
    const std::int64_t now = MonotonicNs();
    TakeReports(now);
    WatchNodes(now);
    TakeCommands(now);
    FollowScriptOfGenerator(now);
    PublishOwnHealth(now);
    ShowProgress(now);
    service.Update(now, {++turns}, service_status);
    ending |= runtime::ShouldStop();
    std::this_thread::sleep_for(kLoopPeriod);
  }

  // ---------------------------------------------------------------------------------------- phases of the session

  /// Until every node has reported, so that session time 0 finds all of them ready.
  void WaitForNodes() {
    const std::int64_t begin = MonotonicNs();
    last_loop_ns = begin;
    for (const auto& node : nodes) {
      node->Start(begin);
    }
    if (!settings.attach.empty()) PointTo(settings.attach / "session", folder.path);
    service.Ready();
    const auto ready = [](const auto& node) { return node->has_reported() || node->failed(); };
    const auto seen = [this](NodeId node) { return record.node(node).seen; };
    while (
        !ending &&
        !(std::all_of(nodes.begin(), nodes.end(), ready) && std::all_of(remote_ids.begin(), remote_ids.end(), seen)) &&
        MonotonicNs() - begin < kLongestStart) {
      Turn();
    }
  }

  void BeginSession() {
    const std::int64_t now = MonotonicNs();
    start_ns = now + kLeadTime;
    SceneManifest manifest;
    manifest.stamp = {1, static_cast<std::uint64_t>(now), now};
    manifest.scene_name = scene.view().name;
    manifest.session_id = folder.session_id;
    manifest.scene_hash = scene.view().hash;
    manifest.session_start_ns = start_ns;
    manifest.recorded = HasRecorder(settings);
    if (assessed) assessed->Begin(start_ns);
    if (!manifests->Write(manifest)) {
      Fail(ExitCode::kFailure, "the session could not be announced on the bus");
      ending = true;
    }
  }

  void EndNodes() {
    TakeReports(MonotonicNs());
    reached_s = ReachedTime();
    ended = true;
    if (assessed) assessed->End(reached_s);
    // At once: a recording tells by it when the session was over.
    next_health_ns = 0;
    PublishOwnHealth(MonotonicNs());
    if (link) {
      link->SayBye();
    }
    service.Stopping();
    const auto recorder =
        std::find_if(nodes.begin(), nodes.end(), [](const auto& node) { return node->id() == NodeId::kRecorder; });
    End({nodes.begin(), recorder});
    // Last, so that it has seen the others end.
    End({recorder, nodes.end()});
  }

  void End(std::span<std::unique_ptr<SupervisedNode>> some) {
    std::vector<SupervisedNode*> all;
    for (const auto& node : some) all.push_back(node.get());
    EndAll(
        all,
        [this](std::int64_t now) {
          TakeReports(now);
          PublishOwnHealth(now);
        },
        [this](const SupervisedNode& node, const char* done) {
          progress.Say(std::string("! ") + NodeName(node.id()) + " did not end in time and " + done);
        });
  }

  void Judge() {
    if (failed_code != ExitCode::kDone) {
      Fail(failed_code, failed_why);
    }
    for (const auto& node : nodes) {
      const NodeFigures& figures = record.node(node->id());
      if (!figures.seen) {
        Fail(ExitCode::kFailure, std::string(NodeName(node->id())) + " never reported; see " + node->log());
      }
    }
    for (const NodeId node : remote_ids) {
      if (!record.node(node).seen) {
        Fail(ExitCode::kFailure,
             std::string(NodeName(node)) + " on " + settings.peer +
                 " never reported; does `fulcrum host` run there, with this machine as its --peer?");
      }
    }
    if (const std::string missing = MissingFrom(record, DemandsUntil(scene.view(), reached_s)); !missing.empty()) {
      Fail(ExitCode::kFailure, missing);
    }
  }

  void CleanUp() {
    link.reset();
    link_bus.reset();
    commands.reset();
    replies.reset();
    orders.reset();
    events.reset();
    healths_in.reset();
    healths_out.reset();
    manifests.reset();
    generator_out.reset();
    if (assessed) assessed->Close();
    participant.reset();
    bus::RemoveSharedMemory(memory);
    std::error_code no_link;
    if (!settings.attach.empty()) std::filesystem::remove(settings.attach / "session", no_link);
    RemoveCheckpoints(folder);
  }

  /// A row in the trainees' database. What cannot be written there is still in assessment.json.
  void Remember(SessionOutcome* outcome) {
    if (!training) return;
    try {
      training->Add(TrainingRowOf(*outcome));
    } catch (const InputError& error) {
      Fail(ExitCode::kFailure, error.what());
      outcome->exit_code = exit_code;
      outcome->verdict = verdict;
    }
  }

  void Report() {
    SessionOutcome outcome;
    outcome.scene_name = scene.view().name;
    outcome.session_id = folder.session_id;
    outcome.started_utc = folder.started_utc;
    outcome.machine = DescribeMachine();
    outcome.configuration = folder.configuration;
    outcome.nodes = node_ids;
    outcome.nodes.insert(outcome.nodes.end(), remote_ids.begin(), remote_ids.end());
    outcome.duration_s = reached_s;
    outcome.wanted_s = end_s;
    outcome.exit_code = exit_code;
    outcome.verdict = verdict;
    outcome.recording = recording;
    outcome.trainee = settings.trainee;
    if (assessed) {
      outcome.sheet = assessed->Finish();
      WriteFile(folder.path / "assessment.json", SheetJson(*outcome.sheet, {outcome.scene_name, outcome.session_id,
                                                                            outcome.trainee, outcome.started_utc}));
      Remember(&outcome);
    }
    WriteFile(folder.path / "summary.json", SummaryJson(outcome, record));
    outcome.cut_map = WriteCutMap(recording, scene.view(), folder.path);
    const std::filesystem::path clip = folder.path / "clip.mp4";
    (void)MakeClip(folder.frames, clip, folder.logs / "clip.log");
    WriteFile(folder.path / "report.html", ReportHtml(outcome, record, folder.frames, clip));
    progress.Say("\n" + FinalTable(outcome, record) + "report: " + (folder.path / "report.html").string());
  }

  const UpSettings settings;
  scene::SceneFile scene;
  const double end_s;  ///< 0: until stopped.
  const std::string keys_warning;
  DomainGuard guard;
  const std::filesystem::path memory;   ///< Right after the guard: who finds a session asks here for its keys.
  std::optional<TrainingLog> training;  ///< Of the trainee, if one was named.
  SessionFolder folder;
  const std::filesystem::path recording;  ///< The recorder's first file; empty: none.
  const NodeStarter starter;
  const std::vector<NodeId> node_ids;
  const std::vector<NodeId> remote_ids;  ///< Of the scene, on another host.

  std::optional<bus::DdsParticipant> participant;
  std::optional<bus::DdsParticipant> link_bus;  ///< On a secured cart: where `link` stands in for remote_ids.
  std::optional<link::Link> link;               ///< To the host of remote_ids.
  std::unique_ptr<bus::Output<SceneManifest>> manifests;
  std::unique_ptr<bus::Output<GeneratorSetting>> generator_out;
  std::unique_ptr<bus::Input<Health>> healths_in;
  std::unique_ptr<bus::Output<Health>> healths_out;
  std::unique_ptr<bus::Input<ThermalEvent>> events;
  std::unique_ptr<bus::Input<Command>> commands;
  std::unique_ptr<bus::Output<CommandReply>> replies;
  std::unique_ptr<bus::Output<Command>> orders;  ///< To nodes.
  std::deque<CommandReply> answered;             ///< The newest, for those who ask again.
  bus::Stamper health_stamper{MonotonicNs()}, reply_stamper{MonotonicNs()}, order_stamper{MonotonicNs()},
      setting_stamper{MonotonicNs()};
  std::int64_t setting_ns = 0;  ///< Stamp of the newest GeneratorSetting.

  GeneratorPanel generator;
  std::optional<SessionAssessment> assessed;

  std::vector<std::unique_ptr<SupervisedNode>> nodes;
  SessionRecord record;
  Progress progress{!settings.attach.empty()};
  bus::Refusals refusals;
  std::array<std::size_t, 2> refusals_told{};  ///< Of the bus, of the link.
  runtime::ServiceNotify service;
  std::string service_status = "starting";
  std::uint64_t turns = 0;
  Health health;  ///< Reused by TakeReports.
  app::RateMeter own_rate;
  std::uint64_t own_ticks = 0;
  std::int64_t start_ns = 0;  ///< CLOCK_MONOTONIC at session time 0; 0: not begun.
  std::int64_t last_loop_ns = 0, next_health_ns = 0;
  std::int64_t next_dump_ns = 0;
  std::int64_t excused_ns = 0;  ///< Until then a degraded node is no fault.
  std::int64_t sweep_ns = 0;    ///< When to sweep; 0: nothing to sweep.
  double reached_s = 0;
  bool ending = false;                     ///< No further turn.
  bool ended = false;                      ///< Session time has stopped.
  ExitCode failed_code = ExitCode::kDone;  ///< Of a node that failed for good.
  std::string failed_why;
  ExitCode exit_code = ExitCode::kDone;
  std::string verdict;
};

Supervisor::Supervisor(const UpSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
Supervisor::~Supervisor() = default;

const std::filesystem::path& Supervisor::session_folder() const { return impl_->folder.path; }

ExitCode Supervisor::Run() {
  Impl& session = *impl_;
  session.progress.Say("session " + session.folder.session_id + " in domain " +
                       std::to_string(session.settings.cart.domain));
  session.WaitForNodes();
  if (!session.ending) {
    session.BeginSession();
  }
  while (!session.ending && (session.end_s <= 0 || session.SessionTime(MonotonicNs()) < session.end_s)) {
    session.Turn();
  }
  session.ending = true;
  session.EndNodes();
  session.Judge();
  session.CleanUp();
  session.Report();
  return session.exit_code;
}

}  // namespace fulcrum::supervisor
