#include "services/apps/replayer/tick_source.h"

#include <algorithm>

#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

std::string Describe(TopicId topic, const SampleKey& key) {
  return std::string(bus::TopicLabel(topic)) + " #" + std::to_string(key.second) + " of epoch " +
         std::to_string(key.first);
}

}  // namespace

TickSource::TickSource(const std::filesystem::path& file, const std::vector<NodeId>& nodes,
                       const std::array<double, kNodeCount>& period_s)
    : reader_(file), period_s_(period_s) {
  for (const NodeId node : nodes) wanted_[static_cast<std::size_t>(node)] = true;
  // Frames and patches are most of a recording and in separate chunks. No replayed node reads them, so they are
  // skipped.
  reader_.PassOver([](const recording::McapChannel& channel) {
    const bus::TopicRole* role = bus::RoleNamed(channel.topic);
    return role != nullptr && role->quality.path != bus::Path::kSharedMemory;
  });
}

bool TickSource::Next(RecordedTick* tick) {
  recording::McapMessage message{};
  for (;;) {
    while (!ended_ && (pending_.empty() || pending_.begin()->first > newest_ns_ - kSettle_ns)) {
      if (reader_.Next(&message)) {
        Take(message);
      } else {
        ended_ = true;
      }
    }
    if (pending_.empty()) return false;
    // Ticks of a process after its successor has taken over are ignored; live readers refuse them, too.
    const RecordedTick& next = pending_.begin()->second.tick;
    if (next.epoch >= progress_[static_cast<std::size_t>(next.node)].epoch) break;
    pending_.erase(pending_.begin());
  }
  *tick = std::move(pending_.begin()->second.tick);
  const Pending rest = std::move(pending_.begin()->second);
  pending_.erase(pending_.begin());

  Progress& progress = progress_[static_cast<std::size_t>(tick->node)];
  const bool first = progress.epoch != tick->epoch;
  if (first) progress = {tick->epoch, 0, 0, {}};
  const bool haptics = tick->node == NodeId::kHaptics;
  if (rest.sequence != progress.sequence + 1 && !(haptics && rest.sequence == progress.sequence)) {
    tick->missing = "the recording lacks " + std::to_string(rest.sequence - progress.sequence - 1) +
                    (haptics ? " manifests of " : " ticks of ") + NodeName(tick->node) + " before this one";
  } else if (first && !haptics && tick->tick.index != 0) {
    tick->missing = "the recording begins " + std::to_string(tick->tick.index) + " ticks after the start of " +
                    NodeName(tick->node);
  }
  progress.sequence = rest.sequence;
  if (!rest.has_manifest) Complete(tick);
  progress.index = tick->tick.index;
  for (const ConsumedInput& consumed : rest.consumed) {
    switch (consumed.topic) {
      case TopicId::kToolState:
        Fetch(*tick, consumed, tools_, &tick->tools, &tick->missing);
        break;
      case TopicId::kHandleState:
        Fetch(*tick, consumed, handles_, &tick->handles, &tick->missing);
        break;
      case TopicId::kGeneratorSetting:
        Fetch(*tick, consumed, generator_, &tick->generator, &tick->missing);
        break;
      case TopicId::kTopologyState:
        Fetch(*tick, consumed, topology_, &tick->topology, &tick->missing);
        break;
      case TopicId::kOpenCells:
        Fetch(*tick, consumed, open_cells_, &tick->open_cells, &tick->missing);
        break;
      case TopicId::kTearState:
        Fetch(*tick, consumed, tears_, &tick->tears, &tick->missing);
        break;
      case TopicId::kCauteryContact:
        Fetch(*tick, consumed, cautery_, &tick->cautery, &tick->missing);
        break;
      case TopicId::kContactModel:
        Fetch(*tick, consumed, models_, &tick->model, &tick->missing);
        break;
      case TopicId::kOperatorInput:
        Fetch(*tick, consumed, operators_, &tick->operators, &tick->missing);
        break;
      default:
        break;
    }
  }
  return true;
}

std::vector<std::string> TickSource::Faults() const {
  std::vector<std::string> faults;
  for (const recording::McapFault& fault : reader_.faults()) {
    faults.push_back("at byte " + std::to_string(fault.offset) + ": " + fault.what);
  }
  if (undecodable_ > 0) faults.push_back(std::to_string(undecodable_) + " messages are not of their topic's type");
  return faults;
}

void TickSource::Complete(RecordedTick* tick) {
  tick->tick.index = progress_[static_cast<std::size_t>(tick->node)].index + 1;
  if (session_) {
    tick->tick.session_time_s = 1e-9 * static_cast<double>(tick->tick.stamp_ns - session_->session_start_ns);
  } else if (tick->missing.empty()) {
    tick->missing = "the recording lacks the start of the session (no SceneManifest)";
  }
}

template <class T>
void TickSource::Fetch(const RecordedTick& tick, const ConsumedInput& consumed, const SampleShelf<T>& shelf,
                       std::vector<T>* samples, std::string* missing) {
  const SampleKey key{consumed.epoch, consumed.sequence};
  SampleKey& last = progress_[static_cast<std::size_t>(tick.node)].consumed[consumed.topic];
  if (key.second == 0 || key == last) return;
  last = key;
  if (const T* found = shelf.Find(key)) {
    samples->push_back(*found);
  } else if (missing->empty()) {
    *missing = std::string(NodeName(tick.node)) + " consumed " + Describe(consumed.topic, key) +
               ", which the recording lacks" +
               (shelf.EndsBefore(key) ? ": the last of its process, which died before sending it to the recorder" : "");
  }
}

template <class T>
bool TickSource::Decode(const recording::McapMessage& message, T* sample) {
  const bool good = bus::DecodeCdr(message.data, sample);
  undecodable_ += good ? 0 : 1;
  return good;
}

void TickSource::Take(const recording::McapMessage& message) {
  auto known = topic_of_.find(message.channel);
  if (known == topic_of_.end()) {
    const bus::TopicRole* role = bus::RoleNamed(reader_.channels().at(message.channel).topic);
    if (role == nullptr) return;
    known = topic_of_.emplace(message.channel, role->id).first;
  }
  switch (known->second) {
    case TopicId::kToolState:
      if (ToolState tools; wanted(NodeId::kPhysics) && Decode(message, &tools)) tools_.Put(tools);
      break;
    case TopicId::kHandleState:
      if (HandleState handles; (wanted(NodeId::kPhysics) || wanted(NodeId::kThermal)) && Decode(message, &handles)) {
        handles_.Put(handles);
      }
      break;
    case TopicId::kGeneratorSetting:
      if (GeneratorSetting setting; wanted(NodeId::kThermal) && Decode(message, &setting)) generator_.Put(setting);
      break;
    case TopicId::kTopologyState:
      if (TopologyState topology; wanted(NodeId::kPhysics) && Decode(message, &topology)) topology_.Put(topology);
      break;
    case TopicId::kOpenCells:
      if (OpenCells cells; wanted(NodeId::kPhysics) && Decode(message, &cells)) open_cells_.Put(cells);
      break;
    case TopicId::kTearState:
      if (TearState tear; wanted(NodeId::kThermal) && Decode(message, &tear)) tears_.Put(tear);
      break;
    case TopicId::kCauteryContact:
      if (CauteryContact contact; wanted(NodeId::kThermal) && Decode(message, &contact)) cautery_.Put(contact);
      break;
    case TopicId::kContactModel:
      if (ContactModel model; wanted(NodeId::kHaptics) && Decode(message, &model)) models_.Put(model);
      break;
    case TopicId::kOperatorInput:
      if (OperatorInput input; wanted(NodeId::kHaptics) && Decode(message, &input)) operators_.Put(input);
      break;
    case TopicId::kSceneManifest:
      if (SceneManifest manifest; Decode(message, &manifest)) session_ = manifest;
      break;
    case TopicId::kTickManifest:
      if (TickManifest manifest; Decode(message, &manifest)) TakeManifest(manifest);
      break;
    default:
      break;
  }
}

void TickSource::TakeManifest(const TickManifest& manifest) {
  newest_ns_ = std::max(newest_ns_, manifest.stamp.stamp_ns);
  if (!wanted(manifest.node)) return;
  Pending pending;
  pending.tick.node = manifest.node;
  pending.tick.epoch = manifest.stamp.epoch;
  pending.tick.tick = {manifest.tick, manifest.session_time_s, period_s_[static_cast<std::size_t>(manifest.node)],
                       manifest.stamp.stamp_ns};
  pending.sequence = manifest.stamp.sequence;
  for (const std::int64_t ns : manifest.tick_times_ns) {
    if (ns >= manifest.stamp.stamp_ns) break;
    Pending before = pending;
    before.tick.tick.stamp_ns = ns;
    before.has_manifest = false;
    pending_.emplace(ns, std::move(before));
  }
  pending.tick.state_hash = manifest.state_hash;
  pending.consumed = manifest.consumed;
  pending_.emplace(manifest.stamp.stamp_ns, std::move(pending));
}

}  // namespace fulcrum::replay
