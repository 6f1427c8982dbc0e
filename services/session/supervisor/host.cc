#include "services/session/supervisor/host.h"

#include <algorithm>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/cart_security.h"
#include "services/scene/format/scene_file.h"
#include "services/session/supervisor/command_desk.h"
#include "services/session/supervisor/crash_watch.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/session/supervisor/node_process.h"
#include "services/session/supervisor/node_starter.h"
#include "services/session/supervisor/offered_cart.h"
#include "services/session/supervisor/outcome.h"
#include "services/session/supervisor/progress.h"
#include "services/session/supervisor/refusal_journal.h"
#include "services/session/supervisor/session_folder.h"
#include "services/session/supervisor/watch_times.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/link/link.h"
#include "services/transport/link/options.h"

namespace fulcrum::supervisor {
namespace {

using runtime::MonotonicNs;

class Host {
 public:
  explicit Host(const HostSettings& settings)
      : settings_(settings),
        guard_(settings.domain),
        memory_(bus::SharedMemoryDirectory(settings.domain)),
        link_(link::LinkSettings{.far = settings.far, .offer = {}, .scene = {}}) {}

  ExitCode Run() {
    if (settings_.far.keys.empty()) progress_.Say(std::string("! ") + link::kInsecureLink);
    progress_.Say("waiting for the cart at " + settings_.far.peer + ", as " + settings_.far.address +
                  ", in link domain " + std::to_string(settings_.far.domain));
    if (!WaitForSession() || !WaitForScene()) return ExitCode::kDone;
    Begin();
    while (!runtime::ShouldStop() && !failed_ && !IsOver()) Turn();
    End();
    return failed_ ? *failed_ : ExitCode::kDone;
  }

 private:
  void Check() {
    if (const std::string mismatch = link_.mismatch(); !mismatch.empty()) throw MismatchError(mismatch);
  }

  void SayRefusals() {
    refusals_.Take({link_.refusals(), local_ ? local_->refusals() : bus::Refusals()},
                   [this](const std::string& text) { progress_.Say("! refused: " + text); });
  }

  /// Returns false when a stop signal arrived.
  bool WaitForSession() {
    while (!runtime::ShouldStop()) {
      Check();
      SayRefusals();
      const link::Link::Session session = link_.session();
      if (session.number != 0 && !session.over) {
        session_ = session;
        const std::uint32_t refused = session.offer.nodes & ~settings_.allowed;
        if (refused != 0) {
          throw InputError("the cart requests the nodes " + link::NamesOfNodes(refused) + "; this host allows only " +
                           link::NamesOfNodes(settings_.allowed) + ": see --nodes");
        }
        return true;
      }
      const std::int64_t now = MonotonicNs();
      if (progress_.IsDue(now)) progress_.Show(now, "waiting: " + link_.status().error);
      std::this_thread::sleep_for(kLoopPeriod);
    }
    return false;
  }

  bool WaitForScene() {
    double share = 0;
    bool fetched = false;
    while (!runtime::ShouldStop()) {
      Check();
      if (link_.FetchScene(session_.offer, settings_.cache, &share)) {
        if (fetched) progress_.Say("scene \"" + session_.offer.scene_name + "\" received");
        return true;
      }
      fetched = true;
      const std::int64_t now = MonotonicNs();
      if (progress_.IsDue(now)) progress_.Show(now, "receiving the scene: " + Fixed(100 * share, 0) + " %");
      std::this_thread::sleep_for(kLoopPeriod);
    }
    return false;
  }

  void Begin() {
    const link::Offer& offer = session_.offer;
    const std::filesystem::path file = link::CachedScene(settings_.cache, offer.scene_hash);
    config::CartConfig cart = CartOnHost(offer, settings_.far.peer, settings_.cart);
    cart.domain = settings_.domain;
    cart.security.keys = settings_.far.keys;  // Each host has its own folder of keys.
    cart.security.encrypt = cart.security.encrypt && !settings_.far.keys.empty();
    scene_.emplace(file);
    link::CheckReceivedScene(scene_->view(), offer);
    folder_ = MakeSessionFolder(settings_.out, file, *scene_, cart,
                                "  session: " + offer.session_id + "\n  peer: " + settings_.far.peer +
                                    "\n  nodes: " + link::NamesOfNodes(offer.nodes) + "\n");
    crash_watch_.emplace(settings_.domain, memory_, folder_);
    const bus::Security security = app::SecurityOf(cart, bus::kLinkIdentity);
    bus::OpenSharedMemory(settings_.domain, security);
    local_.emplace(bus::DdsSettings{.domain = settings_.domain,
                                    .node_name = "host",
                                    .shared_memory = memory_,
                                    .security = security,
                                    .tissue_vertices = static_cast<int>(scene_->view().rest_position.size())});
    healths_in_ = local_->MakeInput<Health>();
    link_.Join(&*local_, ~offer.nodes);
    desk_.emplace(memory_, guard_, settings_.cart ? settings_.cart->security.group : std::string(),
                  std::vector<CommandDesk::Verb>{
                      {"restart", [this](const std::string& name, std::int64_t now) { return Restart(name, now); }},
                      {"down", [](const std::string&, std::int64_t) {
                         runtime::RequestStop();
                         return CommandAnswer{true, "ending the nodes of this host"};
                       }}});
    last_turn_ns_ = MonotonicNs();
    UpSettings as_there;
    as_there.programs = settings_.programs;
    as_there.cart = cart;
    as_there.quality = settings_.quality;
    as_there.window = settings_.window;
    const std::filesystem::path no_recording;
    const NodeStarter starter{as_there, folder_, no_recording};
    for (int i = 0; i < kNodeCount; ++i) {
      if ((offer.nodes >> i & 1u) != 0) nodes_.emplace_back(starter.Usual(static_cast<NodeId>(i)));
    }
    for (NodeProcess& node : nodes_) node.Start(MonotonicNs());
    progress_.Say("session " + offer.session_id + ": " + link::NamesOfNodes(offer.nodes) + " in domain " +
                  std::to_string(settings_.domain) + ", logs in " + folder_.logs.string());
  }

  CommandAnswer Restart(const std::string& name, std::int64_t now) {
    for (NodeProcess& node : nodes_) {
      if (name != NodeName(node.id()) || !node.running()) continue;
      CommandAnswer answer{true, "restarting " + name + " (pid " + std::to_string(node.pid()) + ")"};
      node.AskRestart(now);
      return answer;
    }
    return {false, "no running node \"" + name + "\" on this host"};
  }

  /// True when the cart has ended the session or offers another one. A broken connection does not end the session.
  bool IsOver() {
    const link::Link::Session now = link_.session();
    return now.over || now.number != session_.number;
  }

  void TakeHealths(std::int64_t now) {
    while (healths_in_->TakeNext(&health_)) {
      for (NodeProcess& node : nodes_) {
        node.OnHealth(health_, now);
      }
    }
  }

  void Turn() {
    const std::int64_t now = MonotonicNs();
    TakeHealths(now);
    if (now - last_turn_ns_ > kHeldUp_ns) {
      for (NodeProcess& node : nodes_) node.ResetTimeouts(TimeoutsFrom(now, now - last_turn_ns_));
    }
    last_turn_ns_ = now;
    for (NodeProcess& node : nodes_) WatchNode(&node, now);
    for (std::size_t i = 0; i < nodes_.size(); ++i) crash_watch_->Note(i, nodes_[i].pid());
    if (sweep_ns_ != 0 && now >= sweep_ns_) {
      sweep_ns_ = 0;
      bus::SweepSharedMemory(memory_);
    }
    desk_->Serve(now);
    Check();
    SayRefusals();
    ShowProgress(now);
    std::this_thread::sleep_for(kLoopPeriod);
  }

  void WatchNode(NodeProcess* node, std::int64_t now) {
    const std::optional<NodeProcess::Death> death = node->Update(now);
    if (!death) return;
    sweep_ns_ = now + kSweepAfter_ns;
    const std::string what = std::string(NodeName(node->id())) + " " + death->cause;
    if (!death->for_good) {
      progress_.Say("! " + what + ": starting it again");
      return;
    }
    const std::string last = LastLine(node->log());
    progress_.Say("! " + what + ", for good; see " + node->log() + (last.empty() ? "" : "\n  " + last));
    const bool own_code = death->end.signal == 0 && death->end.exit_code >= 2 && death->end.exit_code <= 4;
    failed_ = own_code ? static_cast<ExitCode>(death->end.exit_code) : ExitCode::kFailure;
  }

  void ShowProgress(std::int64_t now) {
    if (!progress_.IsDue(now)) return;
    const link::LinkStatus status = link_.status();
    const auto alive = std::count_if(nodes_.begin(), nodes_.end(), [](const NodeProcess& n) { return n.running(); });
    progress_.Show(now, !status.connected
                            ? status.error
                            : "clock " + Fixed(status.offset_us, 0) + " us · round trip " +
                                  Fixed(1e-3 * status.round_trip_us, 2) + " ms · in " +
                                  Fixed(status.received_kB_per_s, 0) + " kB/s · out " + Fixed(status.sent_kB_per_s, 0) +
                                  " kB/s · lost " + std::to_string(status.lost) + " · refused " +
                                  std::to_string(status.refused) + " · " + std::to_string(alive) + "/" +
                                  std::to_string(nodes_.size()) + " nodes");
  }

  void End() {
    progress_.Say(failed_ ? "ending: a node failed" : IsOver() ? "the session is over" : "stopped");
    std::vector<SupervisedNode*> all;
    for (NodeProcess& node : nodes_) all.push_back(&node);
    EndAll(
        all, [this](std::int64_t now) { TakeHealths(now); },
        [this](const SupervisedNode& node, const char* done) {
          progress_.Say(std::string("! ") + NodeName(node.id()) + " did not end in time and " + done);
        });
    desk_.reset();
    link_.Leave();
    healths_in_.reset();
    local_.reset();
    bus::RemoveSharedMemory(memory_);
    RemoveCheckpoints(folder_);
    crash_watch_->Done();
    // The cache keeps a bounded number of scenes; this folder would keep each of them for good.
    std::error_code ignored;
    std::filesystem::remove(folder_.scene, ignored);
  }

  const HostSettings settings_;
  DomainGuard guard_;
  const std::filesystem::path memory_;
  std::optional<CrashWatch> crash_watch_;
  Progress progress_{false};
  std::optional<CommandDesk> desk_;
  std::optional<bus::DdsParticipant> local_;
  link::Link link_;  ///< Ends before the bus that it has ports of.
  link::Link::Session session_;
  std::optional<scene::SceneFile> scene_;
  SessionFolder folder_;
  std::unique_ptr<bus::Input<Health>> healths_in_;
  std::vector<NodeProcess> nodes_;
  Health health_;
  std::int64_t last_turn_ns_ = 0, sweep_ns_ = 0;
  std::optional<ExitCode> failed_;
  RefusalJournal refusals_;
};

}  // namespace

ExitCode RunHost(const HostSettings& settings) { return Host(settings).Run(); }

}  // namespace fulcrum::supervisor
