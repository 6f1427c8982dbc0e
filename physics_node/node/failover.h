// A physics node of a pair: it leads, or follows the other process and takes over from its checkpoint.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>

#include "physics_node/node/pair.h"
#include "physics_node/node/physics_node.h"

namespace fulcrum::physics {

class Failover {
 public:
  /// Makes a node that leads, from its checkpoint, or one that follows.
  using MakeNode = std::function<void(bool follows, std::optional<PhysicsNode>* node)>;

  /// @param peer_checkpoint file of the other process, locked while that runs.
  /// @param epoch_ns of this process.
  Failover(const SceneView& scene, MakeNode make, bus::Input<TickManifest>& manifests,
           std::filesystem::path peer_checkpoint, bool follows, std::int64_t epoch_ns);

  /// One period. Always called by the same thread.
  void Step(const Tick& tick);
  /// Any thread. The state of a following process is kWaiting.
  void FillHealth(Health* health);
  /// The node continues from a checkpoint.
  [[nodiscard]] bool restored() const { return node_->restored(); }

 private:
  void TakeOver(const Tick& tick);
  void Retire();

  const SceneView& scene_;
  MakeNode make_;
  const std::filesystem::path peer_checkpoint_;
  Pair pair_;
  std::atomic<bool> leads_;
  std::mutex replacing_;  ///< Protects the replacement of the node against FillHealth.
  std::optional<PhysicsNode> node_;
};

}  // namespace fulcrum::physics
