// Two processes of one node: one leads, the other follows and takes over after a timeout of the leader's manifests.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"
#include "services/transport/bus/port.h"

namespace fulcrum::physics {

/// The TickManifests on the bus identify the leader. Each leading process has its own epoch, and the highest epoch
/// leads: of two processes that both lead, the one that began later continues, and readers refuse the samples of the
/// other (services/transport/bus: a past epoch is refused).
class Pair {
 public:
  enum class Role : std::uint8_t {
    kFollows,
    kTakesOver,  ///< The leader has exited or timed out: from this tick on this process leads.
    kLeads,
    kRetires  ///< Another process has taken over: from now on this one follows.
  };

  /// @param own_epoch of the manifests that this process sends if it leads from the start.
  Pair(bus::Input<TickManifest>& manifests, NodeId node, bool leads, std::uint64_t own_epoch)
      : manifests_(manifests), node_(node), role_(leads ? Role::kLeads : Role::kFollows), own_epoch_(own_epoch) {}

  /// Once in each tick, before all other stages.
  /// @param other_holds the other process holds the lock of its checkpoint. The kernel releases the lock of a process
  ///   that exits, so a leader that held it and no longer does has exited, independent of the deadline.
  [[nodiscard]] Role Update(std::int64_t now_ns, bool other_holds);
  /// Of the manifests since kTakesOver.
  [[nodiscard]] std::uint64_t own_epoch() const { return own_epoch_; }

  /// Timeout of the leader's manifests [ns]: three and a half periods of 10 ms.
  static constexpr std::int64_t kDeadline_ns = 35'000'000;
  /// Timeout of a following process for the first manifest of a leader [ns].
  static constexpr std::int64_t kLongestStart_ns = 500'000'000;

 private:
  bus::Input<TickManifest>& manifests_;
  NodeId node_;
  Role role_;
  std::uint64_t own_epoch_;
  std::uint64_t leader_epoch_ = 0;
  std::uint64_t holder_epoch_ = 0;  ///< Of the newest leader that held its checkpoint.
  std::int64_t received_ns_ =
      0;                         ///< Last manifest of the leader, or end of an own pause; 0: before the first Update().
  std::int64_t updated_ns_ = 0;  ///< Last Update().
  TickManifest manifest_;
};

}  // namespace fulcrum::physics
