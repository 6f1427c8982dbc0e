#include "physics_node/node/pair.h"

#include <algorithm>

namespace fulcrum::physics {

Pair::Role Pair::Update(std::int64_t now_ns, bool other_holds) {
  bool received = false;
  while (manifests_.TakeNext(&manifest_)) {
    if (manifest_.node != node_ || manifest_.stamp.epoch == own_epoch_) continue;
    received = true;
    leader_epoch_ = std::max(leader_epoch_, manifest_.stamp.epoch);
  }
  // After a pause of this process itself, missing manifests do not mean that the leader is silent: restart the timeout.
  const bool paused = updated_ns_ != 0 && now_ns - updated_ns_ > kDeadline_ns;
  updated_ns_ = now_ns;
  if (received || paused || received_ns_ == 0) received_ns_ = now_ns;
  if (role_ == Role::kTakesOver) role_ = Role::kLeads;
  if (role_ == Role::kRetires) role_ = Role::kFollows;
  if (role_ == Role::kLeads && leader_epoch_ > own_epoch_) role_ = Role::kRetires;
  if (received && other_holds) holder_epoch_ = leader_epoch_;
  const bool exited = leader_epoch_ != 0 && holder_epoch_ == leader_epoch_ && !other_holds;
  const bool timed_out = now_ns - received_ns_ > (leader_epoch_ == 0 ? kLongestStart_ns : kDeadline_ns);
  if (role_ == Role::kFollows && (exited || timed_out)) {
    role_ = Role::kTakesOver;
    own_epoch_ = static_cast<std::uint64_t>(now_ns);
  }
  return role_;
}

}  // namespace fulcrum::physics
