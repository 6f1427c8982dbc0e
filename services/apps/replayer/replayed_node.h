// A node in lock step: the class that runs live, with the inputs of recorded ticks, on in-process ports.
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

/// A published message in its encoding on the bus.
struct Published {
  TopicId topic;
  std::vector<std::uint8_t> bytes;  ///< CDR with its encapsulation; empty: the topic has no reader, so it was not made.
};

class ReplayedNode {
 public:
  virtual ~ReplayedNode() = default;
  ReplayedNode(const ReplayedNode&) = delete;
  ReplayedNode& operator=(const ReplayedNode&) = delete;

  [[nodiscard]] NodeId id() const { return id_; }

  /// Computes the tick and returns the state hash after it. A tick of another epoch first restarts the node from its
  /// newest checkpoint, or from the previous one when the recorded state of this tick shows that the process died
  /// between sending its last TickManifest and sealing the checkpoint. May be called from any thread, one at a time.
  std::uint64_t Step(const RecordedTick& tick);

  /// Sets whether further threads of the node take part in the next ticks. The state does not depend on it.
  virtual void LetThreadsHelp(bool /*help*/) {}

  /// Messages that the node published in its last tick. Call at most once per tick.
  [[nodiscard]] virtual std::vector<Published> TakeOutputs() = 0;

  /// Fills in metrics and last error after the last tick. @pre At least one tick was computed.
  virtual void FillHealth(Health* health) const = 0;

 protected:
  explicit ReplayedNode(NodeId id) : id_(id) {}
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  virtual void Start(std::int64_t epoch_ns) = 0;
  virtual std::uint64_t Advance(const RecordedTick& tick) = 0;
  /// Checkpoint of the node; nullptr: it has none.
  virtual runtime::CheckpointFile* checkpoint() { return nullptr; }

 private:
  std::uint64_t StartWith(const RecordedTick& tick);
  std::uint64_t StartAgain(const RecordedTick& tick);

  NodeId id_;
  bool started_ = false;
  std::uint64_t epoch_ = 0;
  unsigned float_state_;  ///< Floating-point state, separate for each node: thermal flushes denormal numbers to zero.
};

/// Settings of a replayed node. Scene and cart must outlive it.
struct NodeMaking {
  const SceneView& scene;
  const config::CartConfig& cart;
  std::filesystem::path folder;  ///< Folder for its checkpoint.
  int threads = 1;               ///< Threads per step of physics; its state does not depend on it.
  /// True: ContactModel, CauteryContact and TemperaturePatch have a reader. Otherwise the nodes do not make them, as in
  /// a live session. No state depends on it.
  bool outputs_read = true;
  /// True: the node may be restarted in the session and needs a checkpoint.
  bool starts_again = true;
};

/// Makes physics, thermal or haptics. Throws InputError when the node cannot be replayed.
[[nodiscard]] std::unique_ptr<ReplayedNode> MakeReplayedNode(NodeId node, const NodeMaking& making);

}  // namespace fulcrum::replay
