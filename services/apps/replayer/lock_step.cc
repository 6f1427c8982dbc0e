#include "services/apps/replayer/lock_step.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <tuple>
#include <utility>

#include "services/apps/replayer/published_difference.h"
#include "services/apps/replayer/replayed_node.h"
#include "services/apps/replayer/session_facts.h"
#include "services/apps/replayer/tick_source.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/histogram.h"
#include "services/records/recording/mcap_reader.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

constexpr double kNsToS = 1e-9, kNsToMs = 1e-6;

/// A node that computes its ticks on its own thread. When at least as many nodes compute (`at_work`) as there are
/// cores, no node uses further threads.
class NodeRunner {
 public:
  NodeRunner(NodeId node, const NodeMaking& making, bool go_on, std::atomic<int>* at_work)
      : node_(MakeReplayedNode(node, making)), go_on_(go_on), further_threads_(making.threads - 1), at_work_(*at_work) {
    result_.node = node;
    thread_ = std::thread([this] { Run(); });
  }
  ~NodeRunner() { End(); }
  NodeRunner(const NodeRunner&) = delete;
  NodeRunner& operator=(const NodeRunner&) = delete;

  /// Adds a tick to the queue. A full queue blocks until it is half empty, so that faster nodes compute in long bursts
  /// and leave all cores to the slowest in between. False: the node has stopped and takes no more ticks.
  bool Give(RecordedTick tick) {
    std::unique_lock lock(mutex_);
    if (queue_.size() >= kQueue) {
      changed_.wait(lock, [&] { return stopped_ || queue_.size() <= kQueue / 2; });
    }
    if (stopped_) return false;
    queue_.push_back(std::move(tick));
    if (queue_.size() == 1) changed_.notify_all();
    return true;
  }

  /// Waits until the last tick is computed; the result is then complete.
  void End() {
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
      changed_.notify_all();
    }
    if (thread_.joinable()) thread_.join();
  }

  [[nodiscard]] NodeResult& result() { return result_; }
  /// Outputs of the tick of the departure.
  [[nodiscard]] const std::vector<Published>& outputs() const { return outputs_; }

 private:
  static constexpr std::size_t kQueue = 256;
  static constexpr std::int64_t kHealthPeriod_ns = 100'000'000;

  void Run() {
    RecordedTick tick;
    ++at_work_;
    while (Take(&tick)) {
      if (!Make(tick)) break;
    }
    --at_work_;
    const runtime::HistogramSnapshot step = step_.snapshot();
    result_.step_p50_ms = kNsToMs * static_cast<double>(step.Quantile(0.5));
    result_.step_p99_ms = kNsToMs * static_cast<double>(step.Quantile(0.99));
    if (result_.ticks > 0 && result_.missing.empty()) LookAtHealth(next_look_ns_);
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
  }

  bool Take(RecordedTick* tick) {
    std::unique_lock lock(mutex_);
    if (queue_.empty() && !ended_) {
      --at_work_;
      changed_.wait(lock, [&] { return ended_ || !queue_.empty(); });
      ++at_work_;
    }
    if (queue_.empty()) return false;
    *tick = std::move(queue_.front());
    queue_.pop_front();
    if (queue_.size() == kQueue / 2) changed_.notify_all();
    return true;
  }

  bool Make(const RecordedTick& tick) {
    if (!tick.missing.empty()) {
      result_.missing = tick.missing;
      return false;
    }
    const std::int64_t begin = runtime::MonotonicNs();
    std::uint64_t hash = 0;
    const int others = at_work_.load(std::memory_order_relaxed) - 1;
    node_->LetThreadsHelp(others == 0 ||
                          others + further_threads_ < static_cast<int>(std::thread::hardware_concurrency()));
    try {
      hash = node_->Step(tick);
    } catch (const std::exception& error) {
      result_.missing = error.what();
      return false;
    }
    const std::int64_t took_ns = runtime::MonotonicNs() - begin;
    step_.Add(took_ns);
    result_.busy_s += kNsToS * static_cast<double>(took_ns);
    ++result_.ticks;
    result_.starts += tick.epoch != epoch_ ? 1 : 0;
    epoch_ = tick.epoch;
    result_.session_time_s = tick.tick.session_time_s;
    result_.state_hash = hash;
    if (tick.tick.stamp_ns >= next_look_ns_) LookAtHealth(tick.tick.stamp_ns);
    if (!tick.state_hash) return true;
    ++result_.compared;
    if (*tick.state_hash == hash) return true;
    ++result_.mismatches;
    if (result_.departure) return go_on_;
    result_.departure = Departure{
        tick.tick.index, tick.tick.session_time_s, tick.tick.stamp_ns, tick.epoch, *tick.state_hash, hash, {}};
    outputs_ = node_->TakeOutputs();
    return go_on_;
  }

  void LookAtHealth(std::int64_t now_ns) {
    next_look_ns_ = now_ns + kHealthPeriod_ns;
    Health health;
    health.state = HealthState::kRunning;
    node_->FillHealth(&health);
    for (const Metric& metric : health.metrics) {
      const auto [known, fresh] =
          result_.health.try_emplace(metric.name, HealthFigure{metric.value, metric.value, metric.value});
      if (fresh) continue;
      HealthFigure& figure = known->second;
      figure = {metric.value, std::min(figure.least, metric.value), std::max(figure.most, metric.value)};
    }
  }

  std::unique_ptr<ReplayedNode> node_;
  NodeResult result_;
  runtime::Histogram step_;
  std::vector<Published> outputs_;
  const bool go_on_;
  const int further_threads_;
  std::atomic<int>& at_work_;
  std::uint64_t epoch_ = 0;
  std::int64_t next_look_ns_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<RecordedTick> queue_;
  bool ended_ = false, stopped_ = false;
  std::thread thread_;
};

/// Nodes of which the recording contains more than one process, by their channels, since each process has its own. All
/// nodes when the recording is damaged.
std::vector<NodeId> RestartedNodes(const std::filesystem::path& recording, const std::vector<NodeId>& nodes) {
  recording::McapReader heads(recording, recording::McapReader::Depth::kChunkHeads);
  recording::McapMessage none;
  while (heads.Next(&none)) {
  }
  std::vector<NodeId> again = nodes;
  if (!heads.closed() || !heads.faults().empty()) return again;
  std::erase_if(again, [&](NodeId node) {
    return std::count_if(heads.channels().begin(), heads.channels().end(), [&](const auto& channel) {
             const auto& [topic, about] = std::tie(channel.second.topic, channel.second.metadata);
             const auto name = about.find("node");
             return topic == bus::RoleOf(TopicId::kTickManifest).name && name != about.end() &&
                    name->second == NodeName(node);
           }) == 1;
  });
  return again;
}

}  // namespace

bool LockStepResult::good() const {
  return faults.empty() && std::all_of(nodes.begin(), nodes.end(), [](const NodeResult& node) { return node.good(); });
}

LockStepResult ReplayInLockStep(const LockStepSettings& settings, const SceneView& scene,
                                const config::CartConfig& cart, const std::function<void(double)>& progress) {
  const std::int64_t called = runtime::MonotonicNs();
  TickSource source(settings.recording, settings.nodes, NodePeriods(cart));
  std::atomic<int> at_work{0};
  std::vector<std::unique_ptr<NodeRunner>> runners;
  const std::vector<NodeId> start_again = RestartedNodes(settings.recording, settings.nodes);
  for (const NodeId node : settings.nodes) {
    const bool starts_again = std::find(start_again.begin(), start_again.end(), node) != start_again.end();
    const NodeMaking making{scene, cart, settings.folder, settings.physics_threads, settings.figures, starts_again};
    runners.push_back(std::make_unique<NodeRunner>(node, making, settings.go_on, &at_work));
  }

  LockStepResult result;
  const std::int64_t begin = runtime::MonotonicNs();
  std::int64_t first_stamp = 0;
  double first_time = 0, told_s = 0;
  std::vector<bool> running(runners.size(), true);
  while (std::find(running.begin(), running.end(), true) != running.end()) {
    RecordedTick tick;
    if (!source.Next(&tick)) break;
    RefuseOtherScene(settings.recording, source.session(), scene);
    const double time = tick.tick.session_time_s;
    if (settings.until_s >= 0 && time > settings.until_s) break;
    if (first_stamp == 0) {
      first_stamp = tick.tick.stamp_ns;
      first_time = time;
    }
    if (settings.rate > 0) {
      const double due_s = kNsToS * static_cast<double>(tick.tick.stamp_ns - first_stamp) / settings.rate;
      const double now_s = kNsToS * static_cast<double>(runtime::MonotonicNs() - begin);
      if (due_s > now_s) std::this_thread::sleep_for(std::chrono::duration<double>(due_s - now_s));
    }
    const auto taker = std::find_if(runners.begin(), runners.end(),
                                    [&](const auto& runner) { return runner->result().node == tick.node; });
    const auto i = static_cast<std::size_t>(taker - runners.begin());
    if (running[i]) running[i] = (*taker)->Give(std::move(tick));
    result.session_s = std::max(result.session_s, time - first_time);
    if (progress && time > told_s + 0.1) {
      told_s = time;
      progress(time);
    }
  }
  for (const auto& runner : runners) runner->End();
  // The time includes reading the recording and making the nodes.
  result.wall_s = kNsToS * static_cast<double>(runtime::MonotonicNs() - called);

  for (const auto& runner : runners) {
    NodeResult& node = runner->result();
    if (node.departure) {
      node.departure->field =
          DescribeDifference(settings.recording, node.departure->epoch, node.departure->stamp_ns, runner->outputs());
    }
    if (node.ticks == 0 && node.missing.empty()) {
      node.missing = std::string("the recording contains no tick of ") + NodeName(node.node);
    }
    result.nodes.push_back(node);
  }
  result.faults = source.Faults();
  return result;
}

}  // namespace fulcrum::replay
