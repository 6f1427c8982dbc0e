#include "services/session/console/admission.h"

#include <algorithm>

namespace fulcrum::console {

Admission::Guests::const_iterator Admission::Loser(const std::string& address) const {
  const auto same = [&](const Guest& guest) { return guest.address == address; };
  if (static_cast<std::size_t>(std::count_if(guests_.begin(), guests_.end(), same)) >= limits_.guests_per_address) {
    return std::find_if(guests_.begin(), guests_.end(), same);
  }
  return guests_.size() >= limits_.guests ? guests_.begin() : guests_.end();
}

Admission::Time Admission::Earliest(const std::string& address, Time now) const {
  const auto loser = Loser(address);
  return loser == guests_.end() ? now : std::max(now, loser->since + limits_.stay);
}

std::optional<Admission::Id> Admission::Enter(Id connection, const std::string& address, Time now) {
  std::optional<Id> closed;
  if (const auto loser = Loser(address); loser != guests_.end()) {
    closed = loser->connection;
    guests_.erase(loser);
  }
  guests_.push_back({connection, address, now});
  return closed;
}

bool Admission::Recognise(Id connection) {
  if (known_.size() >= limits_.known) return false;
  Leave(connection);
  known_.push_back(connection);
  return true;
}

void Admission::Leave(Id connection) {
  std::erase_if(guests_, [&](const Guest& guest) { return guest.connection == connection; });
  std::erase(known_, connection);
}

std::optional<Admission::Id> Admission::TakeOldest() {
  if (guests_.empty()) return {};
  const Id oldest = guests_.front().connection;
  guests_.pop_front();
  return oldest;
}

}  // namespace fulcrum::console
