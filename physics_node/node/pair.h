// Two processes of one node: one leads, the other follows and takes over when the leader falls silent.
#pragma once

#include <cstdint>

#include "services/base/core/messages.h"
#include "services/transport/bus/port.h"

namespace fulcrum::physics {

/// Who leads is told by the TickManifests on the bus. Each process that leads has an epoch of its own, and the higher
/// one leads: of two that believe to lead, the one that began later goes on, and readers take nothing from the other
/// any more (services/transport/bus: an epoch that is past is refused).
class Pair {
 public:
  enum class Role : std::uint8_t {
    kFollows,
    kTakesOver,  ///< The leader is gone, or has been silent for too long: from this tick on this process leads.
    kLeads,
    kRetires  ///< Another process has taken over: from now on this one follows.
  };

  /// @param own_epoch of the manifests that this process sends if it leads from the start.
  Pair(bus::Input<TickManifest>& manifests, NodeId node, bool leads, std::uint64_t own_epoch)
      : manifests_(manifests), node_(node), role_(leads ? Role::kLeads : Role::kFollows), own_epoch_(own_epoch) {}

  /// Once in each tick, before anything else.
  /// @param other_holds the other process holds its checkpoint. The kernel takes it from it when it dies, so one that
  ///   held it and no longer does is gone, whatever the deadline.
  [[nodiscard]] Role Update(std::int64_t now_ns, bool other_holds);
  /// Of the manifests since kTakesOver.
  [[nodiscard]] std::uint64_t own_epoch() const { return own_epoch_; }

  /// A leader that has said nothing for so long is taken for dead: three and a half periods of 10 ms [ns].
  static constexpr std::int64_t kDeadline_ns = 35'000'000;
  /// So long a process that follows waits for the first word of a leader [ns].
  static constexpr std::int64_t kLongestStart_ns = 500'000'000;

 private:
  bus::Input<TickManifest>& manifests_;
  NodeId node_;
  Role role_;
  std::uint64_t own_epoch_;
  std::uint64_t leader_epoch_ = 0;
  std::uint64_t holder_epoch_ = 0;  ///< Of the newest leader that was seen to hold its checkpoint.
  std::int64_t heard_ns_ = 0;       ///< When the leader was last heard, or can have been; 0: not yet updated.
  std::int64_t looked_ns_ = 0;      ///< Last Update().
  TickManifest manifest_;
};

}  // namespace fulcrum::physics
