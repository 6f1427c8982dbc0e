#include "physics_node/node/pair.h"

#include <algorithm>

namespace fulcrum::physics {

Pair::Role Pair::Update(std::int64_t now_ns, bool other_holds) {
  bool heard = false;
  while (manifests_.TakeNext(&manifest_)) {
    if (manifest_.node != node_ || manifest_.stamp.epoch == own_epoch_) continue;
    heard = true;
    leader_epoch_ = std::max(leader_epoch_, manifest_.stamp.epoch);
  }
  // A process that was held up itself must not take its own absence for the leader's.
  const bool absent = looked_ns_ != 0 && now_ns - looked_ns_ > kDeadline_ns;
  looked_ns_ = now_ns;
  if (heard || absent || heard_ns_ == 0) heard_ns_ = now_ns;
  if (role_ == Role::kTakesOver) role_ = Role::kLeads;
  if (role_ == Role::kRetires) role_ = Role::kFollows;
  if (role_ == Role::kLeads && leader_epoch_ > own_epoch_) role_ = Role::kRetires;
  if (heard && other_holds) holder_epoch_ = leader_epoch_;
  const bool gone = leader_epoch_ != 0 && holder_epoch_ == leader_epoch_ && !other_holds;
  const bool silent = now_ns - heard_ns_ > (leader_epoch_ == 0 ? kLongestStart_ns : kDeadline_ns);
  if (role_ == Role::kFollows && (gone || silent)) {
    role_ = Role::kTakesOver;
    own_epoch_ = static_cast<std::uint64_t>(now_ns);
  }
  return role_;
}

}  // namespace fulcrum::physics
