#include "services/records/recorder/recorder_node.h"

#include <fstream>
#include <string>
#include <utility>

#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/nodes/app/cart_security.h"
#include "services/records/recorder/recorder_health.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::recorder {
namespace {

/// Time after its first match for which the number of a participant's matches is reported in Health.
constexpr std::int64_t kReportsMatches_ns = 10 * kSecond_ns;

/// Program of a process, as it was called; empty if it has ended. Without its arguments, because those of `fulcrum up`
/// may name a trainee.
std::string ProgramOf(int pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/cmdline", std::ios::binary);
  std::string program;
  std::getline(in, program, '\0');
  return program;
}

/// Lowest real-time priority: a thread that reads the bus runs before all programs that are not real-time, so that
/// neither a socket overflows nor a ring in shared memory is overwritten while they occupy the processor; and after the
/// threads of servo and solvers.
constexpr int kReadingPriority = 1;

/// To be called on a thread of the bus. Where no real-time priority is permitted, only the buffers bridge a delay.
void RunBeforeOtherPrograms() {
  thread_local bool done = false;
  if (!std::exchange(done, true)) (void)runtime::SetFifoPriority(kReadingPriority);
}

recording::TextMap Describe(const bus::Peer& peer) {
  return {{"node", peer.name}, {"pid", std::to_string(peer.pid)}, {"command", ProgramOf(peer.pid)}};
}

/// Settings of a second participant: that of the app has typed ports of some topics, and a participant can register a
/// type in one way only.
bus::DdsSettings BusSettings(app::NodeApp* app) {
  return {.domain = app->options().domain,
          .node_name = bus::kRecorderPeer,
          .security = app::SecurityOf(app->cart(), bus::SharedMemoryDirectory(app->options().domain),
                                      NodeName(NodeId::kRecorder)),
          .gathers = true};
}

RecorderSettings WithDescription(RecorderSettings settings, const bus::DdsParticipant& bus) {
  settings.describe = [&bus](const bus::WriterGuid& writer) { return Describe(bus.PeerOf(writer)); };
  return settings;
}

}  // namespace

RecorderNode::RecorderNode(app::NodeApp* app, const RecorderSettings& settings)
    : app_(app),
      bus_(BusSettings(app)),
      recorder_(WithDescription(settings, bus_)),
      dumps_(&recorder_, app->options().session) {
  ReceiveAllTopics(app);
  if (settings.keep_s > 0) {
    app->OnOrder("dump", [this](const std::string& reason) { return dumps_.Ask(reason); });
  }
  if (!settings.file.empty()) {
    runtime::Log(runtime::LogLevel::kInfo, "recording into " + settings.file.string());
  }
}

void RecorderNode::ReceiveAllTopics(app::NodeApp* app) {
  for (const auto& role : bus::kTopicRoles) {
    if (!role.recorded()) continue;
    inputs_.push_back(bus_.MakeRawInput(role.id, [this](const bus::RawSample& sample) {
      RunBeforeOtherPrograms();
      recorder_.Receive(sample);
    }));
    app->Watch(role.id, [this, id = role.id, input = inputs_.back().get()] {
      bus::InputStats stats = recorder_.topic_stats(id);
      stats.matched = input->matched();
      return stats;
    });
  }
}

void RecorderNode::Step(const Tick& tick) {
  recorder_.Flush(tick.stamp_ns);
  if (!has_ended_ && !recorder_.stats().ended.empty()) {
    has_ended_ = true;
    app_->PublishHealthNow();
  }
  dumps_.WriteIfAsked(tick.stamp_ns);
}

void RecorderNode::FillHealth(Health* health) const {
  recorder::FillHealth(recorder_.stats(), health);
  if (const std::uint64_t foreign = bus_.foreign_samples(); foreign > 0) {
    health->metrics.push_back({bus::kForeignMetric, static_cast<double>(foreign)});
  }
  // Nodes begin when their writers are matched: only those that have just been discovered wait for it.
  for (const bus::ReadPeer& peer : bus_.PeersRead()) {
    if (runtime::MonotonicNs() - peer.since_ns > kReportsMatches_ns) continue;
    health->metrics.push_back({bus::kReadsMetric + peer.address, static_cast<double>(peer.writers)});
  }
}

void RecorderNode::Close() {
  inputs_.clear();
  recorder_.Close(runtime::MonotonicNs());
}

}  // namespace fulcrum::recorder
