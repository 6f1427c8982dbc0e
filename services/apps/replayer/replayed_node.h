// A node in lock step: the class that runs live, with the inputs of a recorded tick, on ports within this process.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "services/apps/replayer/recorded_tick.h"
#include "services/base/config/cart.h"
#include "services/base/core/scene_view.h"
#include "services/base/runtime/checkpoint.h"

namespace fulcrum::replay {

/// A message as it would have travelled.
struct Published {
  TopicId topic;
  std::vector<std::uint8_t> bytes;  ///< CDR with its encapsulation; empty: nobody reads the topic, so it was not made.
};

class ReplayedNode {
 public:
  virtual ~ReplayedNode() = default;
  ReplayedNode(const ReplayedNode&) = delete;
  ReplayedNode& operator=(const ReplayedNode&) = delete;

  [[nodiscard]] NodeId id() const { return id_; }

  /// Makes the tick and returns the state hash after it. A tick of another epoch first starts the node anew, from the
  /// checkpoint that it has written so far, as its process was: the newest, or the one before if the process died
  /// between telling of a tick and sealing its checkpoint, which the first state shows. Any thread, one at a time.
  std::uint64_t Step(const RecordedTick& tick);

  /// Whether threads of its own, beside the caller's, help in the next ticks. The state does not depend on it.
  virtual void LetThreadsHelp(bool /*help*/) {}

  /// What the node published in its last tick; once for each tick.
  [[nodiscard]] virtual std::vector<Published> TakeOutputs() = 0;

  /// Metrics and last error, as the node tells them after its last tick; at least one was made.
  virtual void FillHealth(Health* health) const = 0;

 protected:
  explicit ReplayedNode(NodeId id) : id_(id) {}
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  virtual void Start(std::int64_t epoch_ns) = 0;
  virtual std::uint64_t Advance(const RecordedTick& tick) = 0;
  /// Null: the node keeps none.
  virtual runtime::CheckpointFile* checkpoint() { return nullptr; }

 private:
  std::uint64_t StartWith(const RecordedTick& tick);
  std::uint64_t StartAgain(const RecordedTick& tick);

  NodeId id_;
  bool started_ = false;
  std::uint64_t epoch_ = 0;
  unsigned float_state_;  ///< Thermal takes tiny numbers for zero on its own thread: kept for each node apart.
};

/// What a replayed node is made of. Scene and cart must outlive it.
struct NodeMaking {
  const SceneView& scene;
  const config::CartConfig& cart;
  std::filesystem::path folder;  ///< For its checkpoint.
  int threads = 1;               ///< That share a step of physics; its state does not depend on it.
  /// Somebody reads ContactModel, CauteryContact and TemperaturePatch; otherwise their nodes, as live, do not make
  /// them. No state depends on it.
  bool outputs_read = true;
  /// It may be started again in the session, and needs a checkpoint to go on from.
  bool starts_again = true;
};

/// For physics, thermal and haptics. Throws InputError when the node cannot be replayed.
[[nodiscard]] std::unique_ptr<ReplayedNode> MakeReplayedNode(NodeId node, const NodeMaking& making);

}  // namespace fulcrum::replay
