#include "tests/support/cart_watch.h"

#include <algorithm>
#include <bit>
#include <chrono>

#include "services/base/runtime/checkpoint.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/compiler/scene_yaml.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/topics.h"
#include "tests/support/cart.h"
#include "tests/support/session_bus.h"

namespace fulcrum::testing {
namespace {

constexpr auto kPeriod = std::chrono::milliseconds(1);
constexpr double kPhysicsStep_s = 0.01;
constexpr std::array kKeepers{NodeId::kPhysics, NodeId::kThermal};

std::uint64_t BitsGone(const std::vector<std::uint8_t>& before, const std::vector<std::uint8_t>& after) {
  std::uint64_t gone = 0;
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
    gone += static_cast<std::uint64_t>(std::popcount(static_cast<unsigned>(before[i] & ~after[i])));
  }
  return gone;
}

}  // namespace

double CartState::Metric(NodeId node, const std::string& name) const {
  const auto health = healths.find(node);
  if (health == healths.end()) return 0;
  const auto& metrics = health->second.metrics;
  const auto it = std::find_if(metrics.begin(), metrics.end(), [&](const auto& metric) { return metric.name == name; });
  return it == metrics.end() ? 0 : it->value;
}

double CartState::peak_force_N() const {
  double peak = 0;
  for (const ForceJudge& judge : judges) peak = std::max(peak, judge.peak_N());
  return peak;
}

double CartState::peak_step_N() const {
  double peak = 0;
  for (const ForceJudge& judge : judges) peak = std::max(peak, judge.peak_step_N());
  return peak;
}

std::string CartState::force_verdict() const {
  for (std::size_t i = 0; i < judges.size(); ++i) {
    if (!judges[i].verdict().empty()) return "tool " + std::to_string(i) + ": " + judges[i].verdict();
  }
  return {};
}

struct CartWatch::Ports {
  explicit Ports(int domain) : participant(ReaderOf(domain, "watch")) {}

  bus::DdsParticipant participant;
  template <class T>
  using Port = std::unique_ptr<bus::Input<T>>;
  Port<HandleState> handles = participant.MakeInput<HandleState>();
  Port<ToolState> tools = participant.MakeInput<ToolState>();
  Port<TissueFrame> frames = participant.MakeInput<TissueFrame>();
  Port<ContactModel> models = participant.MakeInput<ContactModel>();
  Port<CauteryContact> contacts = participant.MakeInput<CauteryContact>();
  Port<TopologyState> topologies = participant.MakeInput<TopologyState>();
  Port<TemperaturePatch> patches = participant.MakeInput<TemperaturePatch>();
  Port<ThermalEvent> events = participant.MakeInput<ThermalEvent>();
  Port<TickManifest> ticks = participant.MakeInput<TickManifest>();
  Port<Health> healths = participant.MakeInput<Health>();

  HandleState handle;
  ToolState tool;
  TissueFrame frame;
  ContactModel model;
  CauteryContact contact;
  TopologyState topology;
  TemperaturePatch patch;
  ThermalEvent event;
  TickManifest tick;
  Health health;
};

CartWatch::CartWatch(int domain, const std::filesystem::path& scene, const std::filesystem::path& session)
    : session_(session), ports_(std::make_unique<Ports>(domain)) {
  const auto tools = scene::ReadSceneYaml(scene, {}).settings.tools;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    state_.judges.emplace_back(haptics::Trocar{tools[i].p_WP.cast<double>(), tools[i].shaft_length_m}, i);
  }
  thread_ = std::jthread([this](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(kPeriod)) {
      const std::lock_guard lock(mutex_);
      Take();
    }
  });
}

CartWatch::~CartWatch() = default;

void CartWatch::Ignore(std::uint64_t epoch) {
  const std::lock_guard lock(mutex_);
  ignored_.insert(epoch);
}

bool CartWatch::WaitForState(double limit_s, const std::function<bool()>& done) {
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < limit_s) {
    if (done()) return true;
    std::this_thread::sleep_for(kPeriod);
  }
  return done();
}

/// Rejects epochs in the future: random bytes may decode to a message with one.
bool CartWatch::IsOfTheCart(const Stamp& stamp, std::int64_t now) const {
  return stamp.epoch != 0 && stamp.epoch <= static_cast<std::uint64_t>(now) && !ignored_.contains(stamp.epoch);
}

void CartWatch::Hear(NodeId node, const Stamp& stamp, std::int64_t now) {
  CartState::Voice& voice = state_.voices[static_cast<std::size_t>(node)];
  if (stamp.epoch > voice.epoch) voice = {stamp.epoch, now};
}

void CartWatch::Take() {
  Ports& p = *ports_;
  const std::int64_t now = runtime::MonotonicNs();
  const auto ours = [this, now](const Stamp& stamp) { return IsOfTheCart(stamp, now); };
  while (p.handles->TakeNext(&p.handle)) {
    const auto& handles = p.handle.handles;
    const bool useful =
        std::any_of(handles.begin(), handles.end(), [](const HandleSample& h) { return h.quality > 0; });
    if (useful && ours(p.handle.stamp)) Hear(NodeId::kHandleBridge, p.handle.stamp, now);
  }
  while (p.tools->TakeNext(&p.tool)) {
    if (!ours(p.tool.stamp)) continue;
    Hear(NodeId::kHaptics, p.tool.stamp, now);
    for (ForceJudge& judge : state_.judges) judge.Add(p.tool);
  }
  TakeFrames(now);
  TakeTopology(now);
  while (p.healths->TakeNext(&p.health)) {
    if (!ours(p.health.stamp)) continue;
    // Of a pair of processes only the leader's Health counts; the follower waits.
    const Health& known = state_.healths[p.health.node];
    const bool follows =
        p.health.state == HealthState::kWaiting && known.state == HealthState::kRunning && known.pid != p.health.pid;
    if (!follows) state_.healths[p.health.node] = p.health;
    const bool drawn = p.health.node == NodeId::kRender && state_.Metric(NodeId::kRender, "frames_drawn") > 0;
    if (drawn) Hear(NodeId::kRender, p.health.stamp, now);
  }
  while (p.models->TakeNext(&p.model) || p.contacts->TakeNext(&p.contact) || p.patches->TakeNext(&p.patch) ||
         p.events->TakeNext(&p.event) || p.ticks->TakeNext(&p.tick)) {
  }
  const auto note = [this](TopicId topic, const auto& port) {
    state_.rejected[static_cast<std::size_t>(topic)] = port->stats().rejected;
  };
  note(TopicId::kHandleState, p.handles);
  note(TopicId::kToolState, p.tools);
  note(TopicId::kTissueFrame, p.frames);
  note(TopicId::kContactModel, p.models);
  note(TopicId::kCauteryContact, p.contacts);
  note(TopicId::kTopologyState, p.topologies);
  note(TopicId::kTemperaturePatch, p.patches);
  note(TopicId::kThermalEvent, p.events);
  note(TopicId::kTickManifest, p.ticks);
  note(TopicId::kHealth, p.healths);
  LookAtCheckpoints();
}

void CartWatch::TakeFrames(std::int64_t now) {
  TissueFrame& frame = ports_->frame;
  while (ports_->frames->TakeLatest(&frame)) {
    const TissueFrameHeader& before = state_.frame;
    if (!IsOfTheCart(frame.header.stamp, now) || frame.header.stamp.epoch < before.stamp.epoch) continue;
    const bool new_process = before.stamp.epoch != 0 && frame.header.stamp.epoch > before.stamp.epoch;
    if (new_process) {
      const double restored_s = frame.header.simulated_time_s - kPhysicsStep_s;
      state_.tissue_lost_s = std::max(state_.tissue_lost_s, before.simulated_time_s - restored_s);
    }
    Hear(NodeId::kPhysics, frame.header.stamp, now);
    state_.frame = frame.header;
  }
}

void CartWatch::TakeTopology(std::int64_t now) {
  TopologyState& topology = ports_->topology;
  while (ports_->topologies->TakeLatest(&topology)) {
    if (!IsOfTheCart(topology.stamp, now)) continue;
    const TopologyState& known = state_.topology;
    if (topology.revision < known.revision) state_.topology_lost += known.revision - topology.revision;
    state_.topology_lost += BitsGone(known.dead_edges, topology.dead_edges);
    Hear(NodeId::kThermal, topology.stamp, now);
    std::swap(state_.topology, topology);
  }
}

void CartWatch::LookAtCheckpoints() {
  for (const NodeId node : kKeepers) {
    CartState::Seal& seal = state_.seals[node];
    const std::uint64_t sequence = runtime::NewestSequence(session_ / (std::string(NodeName(node)) + ".checkpoint"));
    // The time between this observation and the last one counts as lost.
    if (sequence != seal.sequence) seal = {sequence, last_look_ns_};
  }
  last_look_ns_ = runtime::MonotonicNs();
}

}  // namespace fulcrum::testing
