#include "services/apps/replayer/coupled_nodes.h"

#include <filesystem>
#include <iterator>
#include <string>
#include <utility>

#include "services/apps/replayer/what_if.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

constexpr std::size_t kKept = 2048;
constexpr auto kDelay_ns = static_cast<std::int64_t>(1e9 * kCouplingDelay_s);

template <class T>
bool Decode(const Published& published, std::optional<T>* message) {
  if (published.topic != bus::kTopicOf<T>) return false;
  if (!bus::DecodeCdr(published.bytes, &message->emplace())) message->reset();
  return message->has_value();
}

template <class T>
void Keep(const std::optional<T>& sample, std::map<std::int64_t, T>* sent) {
  if (!sample) return;
  sent->insert_or_assign(sample->stamp.stamp_ns, *sample);
  if (sent->size() > kKept) sent->erase(sent->begin());
}

}  // namespace

CoupledNodes::CoupledNodes(const std::vector<NodeId>& nodes, const NodeMaking& making) {
  std::filesystem::create_directories(making.folder);
  for (const NodeId node : nodes) nodes_.emplace(node, MakeReplayedNode(node, making));
}

template <class T>
void CoupledNodes::Replace(NodeId owner, std::vector<T>* inputs, const std::map<std::int64_t, T>& sent) const {
  if (!Has(owner)) return;
  std::vector<T> replaced;
  for (const T& input : *inputs) {
    // An input that the replayed node did not send at that time is left out.
    const auto found = sent.find(input.stamp.stamp_ns);
    if (found != sent.end()) replaced.push_back(found->second);
  }
  *inputs = std::move(replaced);
}

void CoupledNodes::ReplaceTools(std::vector<ToolState>* inputs) const {
  if (!Has(NodeId::kHaptics)) return;
  std::vector<ToolState> replaced;
  for (const ToolState& input : *inputs) {
    const auto later = tools_.upper_bound(input.stamp.stamp_ns);
    if (later != tools_.begin()) replaced.push_back(std::prev(later)->second);
  }
  *inputs = std::move(replaced);
}

template <class T>
void CoupledNodes::Deliver(const Tick& tick, bool starts, Way<T>* way, std::vector<T>* inputs) {
  inputs->clear();
  bool news = starts;
  while (!way->sent.empty() && way->sent.front().stamp.stamp_ns + kDelay_ns <= tick.stamp_ns) {
    way->consumed = std::move(way->sent.front());
    way->sent.pop_front();
    news = true;
  }
  if (news && way->consumed) inputs->push_back(*way->consumed);
}

Outcome CoupledNodes::Step(const RecordedTick& recorded) {
  RecordedTick tick = recorded;
  ReplaceTools(&tick.tools);
  Replace(NodeId::kPhysics, &tick.model, models_);
  Replace(NodeId::kPhysics, &tick.cautery, cautery_);
  const auto [epoch, first] = epochs_.try_emplace(tick.node, tick.epoch);
  const bool starts = first || std::exchange(epoch->second, tick.epoch) != tick.epoch;
  if (tick.node == NodeId::kPhysics && Has(NodeId::kThermal)) {
    Deliver(tick.tick, starts, &topology_, &tick.topology);
    Deliver(tick.tick, starts, &open_cells_, &tick.open_cells);
  }
  if (tick.node == NodeId::kThermal && Has(NodeId::kPhysics)) Deliver(tick.tick, starts, &tears_, &tick.tears);
  ReplayedNode& node = *nodes_.at(tick.node);
  Outcome outcome;
  outcome.state_hash = node.Step(tick);
  for (const Published& published : node.TakeOutputs()) {
    if (std::optional<ThermalEvent> event; Decode(published, &event)) {
      outcome.events.push_back(*event);
    } else if (std::optional<ToolState> tools; Decode(published, &tools)) {
      Keep(tools, &tools_);
    } else {
      (void)(Decode(published, &outcome.frame) || Decode(published, &outcome.model) ||
             Decode(published, &outcome.cautery) || Decode(published, &outcome.topology) ||
             Decode(published, &outcome.open_cells) || Decode(published, &outcome.tear) ||
             Decode(published, &outcome.patch));
    }
  }
  if (tick.node == NodeId::kHaptics && !tools_.empty()) outcome.tools = tools_.rbegin()->second;
  Keep(outcome.model, &models_);
  Keep(outcome.cautery, &cautery_);
  if (outcome.topology && Has(NodeId::kPhysics)) topology_.sent.push_back(*outcome.topology);
  if (outcome.open_cells && Has(NodeId::kPhysics)) open_cells_.sent.push_back(*outcome.open_cells);
  if (outcome.tear && Has(NodeId::kThermal)) tears_.sent.push_back(*outcome.tear);
  return outcome;
}

}  // namespace fulcrum::replay
