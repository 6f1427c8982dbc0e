#include "handle_bridge/node/watched_link.h"

namespace fulcrum::handle_bridge {

ByteLink::Result WatchedLink::Read(std::span<char> buffer) noexcept {
  if (baud_wanted_) {
    baud_wanted_ = !link_->SetBaud(search_.baud());
  }
  const ByteLink::Result read = link_->Read(buffer);
  phase_ = read.phase;
  if (phase_ != LinkPhase::kOpen) {
    hung_up_ = was_open_;
  }
  if (read.fresh) {
    search_.Reconnected();
    reconnects_ += hung_up_ ? 1 : 0;
    was_open_ = true;
    hung_up_ = false;
  }
  return read;
}

void WatchedLink::Evaluate(const LinkCounts& counts, double dt_s) noexcept {
  baud_wanted_ = search_.Add(counts, dt_s) || baud_wanted_;
}

LinkState WatchedLink::state(LinkState channel) const noexcept {
  switch (phase_) {
    case LinkPhase::kLost:
      return LinkState::kLost;
    case LinkPhase::kReconnecting:
      return LinkState::kReconnecting;
    case LinkPhase::kOpen:
      break;
  }
  if (search_.searching() && channel != LinkState::kNoData) {
    return LinkState::kGarbage;
  }
  return channel == LinkState::kOk && search_.found_other() ? LinkState::kWrongBaud : channel;
}

}  // namespace fulcrum::handle_bridge
