#include "services/apps/replayer/replayed_node.h"

#include <xmmintrin.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "haptics_node/node/cart_devices.h"
#include "haptics_node/node/haptics_node.h"
#include "haptics_node/node/trocar_store.h"
#include "physics_node/node/physics_checkpoint.h"
#include "physics_node/node/physics_node.h"
#include "services/base/core/error.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/in_process.h"
#include "thermal_node/node/thermal_node.h"

namespace fulcrum::replay {
namespace {

/// A topic that the node reads.
template <class T>
struct Inlet {
  bus::InProcessTopic<T> topic;
  std::unique_ptr<bus::Input<T>> in = topic.MakeInput();
  std::unique_ptr<typename bus::OutputOf<T>::type> out = topic.MakeOutput();
  void Give(const std::vector<T>& samples) {
    for (const T& sample : samples) out->Write(sample);
  }
};

/// A topic that the node writes.
template <class T>
struct Outlet {
  bus::InProcessTopic<T> topic;
  std::unique_ptr<typename bus::OutputOf<T>::type> out = topic.MakeOutput();
  std::unique_ptr<bus::Input<T>> in = topic.MakeInput();
  T sample;
  /// Appends the messages of the last tick, oldest first.
  void TakeInto(std::vector<Published>* published) {
    if (!in) published->push_back({bus::kTopicOf<T>, {}});
    while (in && in->TakeNext(&sample)) {
      Published message{bus::kTopicOf<T>, {}};
      if (bus::EncodeCdr(sample, &message.bytes)) published->push_back(std::move(message));
    }
  }
  void Drop() {
    if (in) (void)in->TakeLatest(&sample);
  }
};

/// Checkpoint file of a node that may be restarted in the session.
class OptionalCheckpoint {
 public:
  /// @param capacity function, because the size takes time to compute and is needed for a checkpoint only.
  template <class Capacity>
  OptionalCheckpoint(const NodeMaking& making, NodeId node, std::uint32_t layout, const Capacity& capacity) {
    if (!making.starts_again) return;
    file_.emplace(making.folder / (std::string(NodeName(node)) + ".checkpoint"), making.scene.hash, layout, capacity());
  }
  [[nodiscard]] runtime::CheckpointFile* file() { return file_ ? &*file_ : nullptr; }

 private:
  std::optional<runtime::CheckpointFile> file_;
};

class ReplayedPhysics final : public ReplayedNode {
 public:
  explicit ReplayedPhysics(const NodeMaking& making)
      : ReplayedNode(NodeId::kPhysics),
        scene_(making.scene),
        threads_(making.threads),
        checkpoint_(making, id(), physics::kCheckpointLayout,
                    [this] { return physics::CheckpointCapacity(static_cast<Index>(scene_.rest_position.size())); }) {
    if (!making.outputs_read) {
      contacts_.in.reset();
      cautery_.in.reset();
    }
  }

  std::vector<Published> TakeOutputs() override {
    std::vector<Published> published;
    // A frame has no reader in a replay, so it is made on request only.
    TissueFrame frame;
    node_->FillFrame(tick_, {frame.header, frame.xyz});
    frame.header.stamp.epoch = epoch();
    frame.header.stamp.stamp_ns = tick_.stamp_ns;
    Published message{TopicId::kTissueFrame, {}};
    if (bus::EncodeCdr(frame, &message.bytes)) published.push_back(std::move(message));
    contacts_.TakeInto(&published);
    cautery_.TakeInto(&published);
    tears_.TakeInto(&published);
    clips_.TakeInto(&published);
    return published;
  }
  void FillHealth(Health* health) const override { node_->FillHealth(health); }
  void LetThreadsHelp(bool help) override { help_ = help; }

 private:
  runtime::CheckpointFile* checkpoint() override { return checkpoint_.file(); }
  void Start(std::int64_t epoch_ns) override {
    node_.reset();
    // A new process begins with empty ports.
    tools_ = {};
    handles_ = {};
    topology_ = {};
    open_cells_ = {};
    node_.emplace(scene_,
                  physics::PhysicsNode::Ports{*tools_.in, *handles_.in, *topology_.in, *open_cells_.in, *frames_,
                                              *contacts_.out, *cautery_.out, *tears_.out, *manifests_.out, *clips_.out},
                  checkpoint_.file(), epoch_ns, threads_);
  }

  std::uint64_t Advance(const RecordedTick& tick) override {
    tick_ = tick.tick;
    contacts_.Drop();
    cautery_.Drop();
    tears_.Drop();
    clips_.Drop();
    tools_.Give(tick.tools);
    handles_.Give(tick.handles);
    topology_.Give(tick.topology);
    open_cells_.Give(tick.open_cells);
    node_->LetThreadsHelp(help_);
    node_->Step(tick.tick);
    (void)manifests_.in->TakeLatest(&manifests_.sample);
    return manifests_.sample.state_hash;
  }

  const SceneView& scene_;
  const int threads_;
  bool help_ = true;
  OptionalCheckpoint checkpoint_;
  Inlet<ToolState> tools_;
  Inlet<HandleState> handles_;
  Inlet<TopologyState> topology_;
  Inlet<OpenCells> open_cells_;
  bus::InProcessTopic<TissueFrame> frame_topic_;
  std::unique_ptr<bus::LoanOutput<TissueFrame>> frames_ = frame_topic_.MakeOutput();
  Tick tick_;
  Outlet<ContactModel> contacts_;
  Outlet<CauteryContact> cautery_;
  Outlet<TearState> tears_;
  Outlet<TickManifest> manifests_;
  Outlet<ClipState> clips_;
  std::optional<physics::PhysicsNode> node_;
};

class ReplayedThermal final : public ReplayedNode {
 public:
  explicit ReplayedThermal(const NodeMaking& making)
      : ReplayedNode(NodeId::kThermal),
        scene_(making.scene),
        checkpoint_(making, id(), thermal::kCheckpointLayout,
                    [this] { return thermal::ThermalNode::CheckpointCapacity(scene_); }) {
    if (!making.outputs_read) patches_.in.reset();
  }

  std::vector<Published> TakeOutputs() override {
    std::vector<Published> published;
    topology_.TakeInto(&published);
    open_cells_.TakeInto(&published);
    patches_.TakeInto(&published);
    events_.TakeInto(&published);
    return published;
  }
  void FillHealth(Health* health) const override { node_->FillHealth(health); }

 private:
  runtime::CheckpointFile* checkpoint() override { return checkpoint_.file(); }
  void Start(std::int64_t epoch_ns) override {
    node_.reset();
    contacts_ = {};
    tears_ = {};
    handles_ = {};
    generator_ = {};
    node_.emplace(scene_,
                  thermal::ThermalNode::Ports{*contacts_.in, *tears_.in, *handles_.in, *generator_.in, *topology_.out,
                                              *open_cells_.out, *patches_.out, *events_.out, *manifests_.out},
                  checkpoint_.file(), epoch_ns);
  }

  std::uint64_t Advance(const RecordedTick& tick) override {
    topology_.Drop();
    open_cells_.Drop();
    patches_.Drop();
    events_.Drop();
    contacts_.Give(tick.cautery);
    tears_.Give(tick.tears);
    handles_.Give(tick.handles);
    generator_.Give(tick.generator);
    node_->Step(tick.tick);
    (void)manifests_.in->TakeLatest(&manifests_.sample);
    return manifests_.sample.state_hash;
  }

  const SceneView& scene_;
  OptionalCheckpoint checkpoint_;
  Inlet<CauteryContact> contacts_;
  Inlet<TearState> tears_;
  Inlet<HandleState> handles_;
  Inlet<GeneratorSetting> generator_;
  Outlet<TopologyState> topology_;
  Outlet<OpenCells> open_cells_;
  Outlet<TemperaturePatch> patches_;
  Outlet<ThermalEvent> events_;
  Outlet<TickManifest> manifests_;
  std::optional<thermal::ThermalNode> node_;
};

class ReplayedHaptics final : public ReplayedNode {
 public:
  explicit ReplayedHaptics(const NodeMaking& making)
      : ReplayedNode(NodeId::kHaptics), scene_(making.scene), cart_(making.cart) {
    for (std::size_t i = 0; i < kMaxTools; ++i) {
      if (cart_.devices[i].kind == config::DeviceKind::kTouch && scene_.tools[i].kind != ToolKind::kNone) {
        throw InputError("haptics_node cannot be replayed: tool " + std::to_string(i) +
                         " was moved by a Touch, and no topic contains the states of its motors and encoders. Replay "
                         "physics and thermal; for haptics record with simulated devices");
      }
    }
  }

  std::vector<Published> TakeOutputs() override {
    std::vector<Published> published;
    tools_.TakeInto(&published);
    return published;
  }
  void FillHealth(Health* health) const override { node_->FillHealth(health); }

 private:
  void Start(std::int64_t epoch_ns) override {
    node_.reset();
    models_ = {};
    operators_ = {};
    haptics::CartDevices cart = haptics::MakeCartDevices(cart_, scene_, haptics::TrocarFolder());
    node_.emplace(scene_, std::move(cart.devices),
                  haptics::HapticsNode::Ports{*models_.in, *operators_.in, *tools_.out, *manifests_.out}, epoch_ns);
  }

  std::uint64_t Advance(const RecordedTick& tick) override {
    tools_.Drop();
    models_.Give(tick.model);
    operators_.Give(tick.operators);
    node_->BusStep();
    node_->ServoStep(tick.tick);
    node_->BusStep();
    while (manifests_.in->TakeNext(&manifests_.sample)) {
    }
    return node_->state_hash();
  }

  const SceneView& scene_;
  const config::CartConfig& cart_;
  Inlet<ContactModel> models_;
  Inlet<OperatorInput> operators_;
  Outlet<ToolState> tools_;
  Outlet<TickManifest> manifests_;
  std::optional<haptics::HapticsNode> node_;
};

}  // namespace

std::uint64_t ReplayedNode::Step(const RecordedTick& tick) {
  const bool first = !std::exchange(started_, true);
  const bool goes_on = tick.epoch == std::exchange(epoch_, tick.epoch);
  const unsigned outside = _mm_getcsr();
  std::uint64_t hash = 0;
  if (first) {
    hash = StartWith(tick);
  } else if (goes_on) {
    _mm_setcsr(float_state_);
    hash = Advance(tick);
  } else {
    hash = StartAgain(tick);
  }
  float_state_ = _mm_getcsr();
  _mm_setcsr(outside);
  return hash;
}

/// Starts the node and computes the tick. Does not restore the floating-point state of the thread.
std::uint64_t ReplayedNode::StartWith(const RecordedTick& tick) {
  Start(static_cast<std::int64_t>(tick.epoch));
  return Advance(tick);
}

std::uint64_t ReplayedNode::StartAgain(const RecordedTick& tick) {
  using Bytes = std::vector<std::byte>;
  runtime::CheckpointFile* const file = checkpoint();
  const auto copy = [](const auto& loaded) {
    return loaded ? Bytes(loaded->payload.begin(), loaded->payload.end()) : Bytes();
  };
  // Both checkpoints are copied, because the first tick may write a new one.
  const Bytes newest = file != nullptr ? copy(file->Latest()) : Bytes();
  const Bytes previous = file != nullptr ? copy(file->Previous()) : Bytes();
  const unsigned outside = _mm_getcsr();
  const auto from = [&](const Bytes& bytes) {
    std::ranges::copy(bytes, file->Begin().begin());
    file->Commit(bytes.size());
    _mm_setcsr(outside);
    return StartWith(tick);
  };
  const std::uint64_t hash = StartWith(tick);
  if (previous.empty() || !tick.state_hash || hash == *tick.state_hash) return hash;
  if (const std::uint64_t other = from(previous); other == *tick.state_hash) return other;
  return from(newest);
}

std::unique_ptr<ReplayedNode> MakeReplayedNode(NodeId node, const NodeMaking& making) {
  switch (node) {
    case NodeId::kPhysics:
      return std::make_unique<ReplayedPhysics>(making);
    case NodeId::kThermal:
      return std::make_unique<ReplayedThermal>(making);
    case NodeId::kHaptics:
      return std::make_unique<ReplayedHaptics>(making);
    default:
      throw InputError(std::string(NodeName(node)) + " has no state to replay; valid: physics, thermal, haptics");
  }
}

}  // namespace fulcrum::replay
