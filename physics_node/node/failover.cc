#include "physics_node/node/failover.h"

#include <span>
#include <string>
#include <utility>

#include "physics_node/node/physics_checkpoint.h"
#include "services/base/runtime/checkpoint.h"
#include "services/base/runtime/realtime.h"

namespace fulcrum::physics {

Failover::Failover(const SceneView& scene, MakeNode make, bus::Input<TickManifest>& manifests,
                   std::filesystem::path peer_checkpoint, bool follows, std::int64_t epoch_ns)
    : scene_(scene),
      make_(std::move(make)),
      peer_checkpoint_(std::move(peer_checkpoint)),
      pair_(manifests, NodeId::kPhysics, !follows, static_cast<std::uint64_t>(epoch_ns)),
      leads_(!follows) {
  make_(follows, &node_);
}

void Failover::Step(const Tick& tick) {
  const bool other_holds = !leads_.load(std::memory_order_relaxed) && runtime::IsInUse(peer_checkpoint_);
  switch (pair_.Update(tick.stamp_ns, other_holds)) {
    case Pair::Role::kFollows:
      node_->Follow(tick);
      break;
    case Pair::Role::kTakesOver:
      TakeOver(tick);
      break;
    case Pair::Role::kLeads:
      node_->Step(tick);
      break;
    case Pair::Role::kRetires:
      Retire();
      break;
  }
}

void Failover::TakeOver(const Tick& tick) {
  const auto left = runtime::CheckpointFile::Peek(peer_checkpoint_, scene_.hash, kCheckpointLayout,
                                                  CheckpointCapacity(static_cast<Index>(scene_.rest_position.size())));
  const bool restored = node_->TakeOver(left ? std::span<const std::byte>(*left) : std::span<const std::byte>(), tick);
  leads_.store(true, std::memory_order_relaxed);
  node_->Step(tick);
  runtime::Log(runtime::LogLevel::kWarning,
               std::string("the leading process is gone or silent: this one has taken over, ") +
                   (restored ? "from the newest checkpoint" : "from the beginning: there is no checkpoint"));
}

/// Nothing that this process computed since the other one took over was read. To take over again it needs a node in the
/// state of a new process, which its ports do not tell of the cut again.
void Failover::Retire() {
  const std::lock_guard lock(replacing_);
  leads_.store(false, std::memory_order_relaxed);
  const PhysicsNode::Kept kept = node_->KeptInputs();
  make_(true, &node_);
  node_->TakeKept(kept);
  runtime::Log(runtime::LogLevel::kWarning,
               "the other process has taken over while this one was held up: it follows from now on");
}

void Failover::FillHealth(Health* health) {
  const std::lock_guard lock(replacing_);
  node_->FillHealth(health);
  if (!leads_.load(std::memory_order_relaxed) && health->state == HealthState::kRunning) {
    health->state = HealthState::kWaiting;
  }
}

}  // namespace fulcrum::physics
