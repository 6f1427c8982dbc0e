// physics_node: deforms the tissue under the tools at 100 Hz.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "physics_node/node/pair.h"
#include "physics_node/node/physics_checkpoint.h"
#include "physics_node/node/physics_node.h"
#include "services/app/node_app.h"
#include "services/core/error.h"
#include "services/runtime/checkpoint.h"
#include "services/runtime/cyclic_thread.h"
#include "services/runtime/realtime.h"

namespace {

using namespace fulcrum;  // NOLINT: a main is nothing but names of other modules

/// A node of its own, or one of a pair: "a" and "b" have a checkpoint each.
struct Seat {
  std::string own, other;  ///< Names of the checkpoint files; `other` empty: no pair.
  bool follows = false;
};

Seat TakeSeat(app::NodeOptions* options) {
  const std::string pair = options->TakeValue("--pair", "");
  const bool follows = options->TakeFlag("--follow");
  if (pair.empty() && !follows) return {"physics_node.checkpoint", "", false};
  if (pair != "a" && pair != "b") throw InputError("--pair must be a or b, and --follow goes with it only");
  const auto file = [](const std::string& seat) { return "physics_node-" + seat + ".checkpoint"; };
  return {file(pair), file(pair == "a" ? "b" : "a"), follows};
}

ExitCode RunPhysics(app::NodeApp& app) {
  const Seat seat = TakeSeat(&app.options());
  const std::filesystem::path& session = app.options().session;
  const std::size_t capacity = physics::CheckpointCapacity(static_cast<Index>(app.scene().rest_position.size()));
  runtime::CheckpointFile checkpoint(session / seat.own, app.scene().hash, physics::kCheckpointLayout, capacity);
  const std::int64_t epoch_ns = runtime::MonotonicNs();
  const physics::PhysicsNode::Ports ports{
      app.MakeInput<ToolState>(),       app.MakeInput<HandleState>(),  app.MakeInput<TopologyState>(),
      app.MakeInput<OpenCells>(),       app.MakeOutput<TissueFrame>(), app.MakeOutput<ContactModel>(),
      app.MakeOutput<CauteryContact>(), app.MakeOutput<TearState>(),   app.MakeOutput<TickManifest>(),
  };
  std::optional<physics::PhysicsNode> node;
  const auto make = [&](bool follows) {
    node.emplace(app.scene(), ports, &checkpoint, epoch_ns, app.cart().timing(NodeId::kPhysics).threads, follows);
  };
  make(seat.follows);
  if (!seat.follows) app::LogCheckpoint(checkpoint, node->restored());
  if (seat.other.empty()) {
    return app.Run(
        app.timing(), [&](const Tick& tick) { node->Step(tick); }, [&](Health* health) { node->FillHealth(health); });
  }

  physics::Pair pair(app.MakeInput<TickManifest>(), NodeId::kPhysics, !seat.follows,
                     static_cast<std::uint64_t>(epoch_ns));
  std::atomic<bool> leads{!seat.follows};
  std::mutex replacing;  ///< Of the node, against the health thread.
  const auto step = [&](const Tick& tick) {
    const bool other_holds = !leads.load(std::memory_order_relaxed) && runtime::IsInUse(session / seat.other);
    switch (pair.Update(tick.stamp_ns, other_holds)) {
      case physics::Pair::Role::kFollows:
        node->Follow(tick);
        return;
      case physics::Pair::Role::kTakesOver: {
        const auto left =
            runtime::CheckpointFile::Peek(session / seat.other, app.scene().hash, physics::kCheckpointLayout, capacity);
        const bool restored =
            node->TakeOver(left ? std::span<const std::byte>(*left) : std::span<const std::byte>(), tick);
        leads.store(true, std::memory_order_relaxed);
        node->Step(tick);
        runtime::Log(runtime::LogLevel::kWarning,
                     std::string("the leading process is gone or silent: this one has taken over, ") +
                         (restored ? "from the newest checkpoint" : "from the beginning: there is no checkpoint"));
        return;
      }
      case physics::Pair::Role::kLeads:
        node->Step(tick);
        return;
      case physics::Pair::Role::kRetires: {
        // What this one has computed since nobody has read. To take over again it must be as one that has just started.
        const std::lock_guard lock(replacing);
        leads.store(false, std::memory_order_relaxed);
        make(true);
        runtime::Log(runtime::LogLevel::kWarning,
                     "the other process has taken over while this one was held up: it follows from now on");
        return;
      }
    }
  };
  return app.Run(app.timing(), step, [&](Health* health) {
    const std::lock_guard lock(replacing);
    node->FillHealth(health);
    if (!leads.load(std::memory_order_relaxed) && health->state == HealthState::kRunning) {
      health->state = HealthState::kWaiting;
    }
  });
}

}  // namespace

int main(int argc, char** argv) {
  return app::NodeMain(argc, argv, NodeId::kPhysics,
                       "Deforms the tissue under the tools; publishes TissueFrame, ContactModel and CauteryContact at "
                       "100 Hz.\n"
                       "--pair a|b: one of two processes; --follow: the one that waits and takes over.",
                       RunPhysics);
}
