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
  /// Makes a node that leads from its checkpoint, or one that follows.
  using MakeNode = std::function<void(bool follows, std::optional<PhysicsNode>* node)>;

  /// @param others_checkpoint file of the other process, which holds it locked while it lives.
  /// @param epoch_ns of this process.
  Failover(const SceneView& scene, MakeNode make, bus::Input<TickManifest>& manifests,
           std::filesystem::path others_checkpoint, bool follows, std::int64_t epoch_ns);

  /// One period. Always called by the same thread.
  void Step(const Tick& tick);
  /// Any thread. A process that follows is waiting.
  void FillHealth(Health* health);
  /// It leads from a checkpoint.
  [[nodiscard]] bool restored() const { return node_->restored(); }

 private:
  void TakeOver(const Tick& tick);
  void Retire();

  const SceneView& scene_;
  MakeNode make_;
  const std::filesystem::path others_checkpoint_;
  Pair pair_;
  std::atomic<bool> leads_;
  std::mutex replacing_;  ///< Of the node, against the thread of FillHealth.
  std::optional<PhysicsNode> node_;
};

}  // namespace fulcrum::physics
