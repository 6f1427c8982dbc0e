#include "handle_bridge/protocol/baud_search.h"

namespace fulcrum::handle_bridge {

bool BaudSearch::Add(const LinkCounts& counts, double dt_s) noexcept {
  if (counts.formed() > 0) {
    known_baud_ = baud_;
    settled_ = true;
    searching_ = false;
    next_ = 0;
    bytes_ = 0;
    blind_s_ = 0;
    return false;
  }
  bytes_ += counts.bytes;
  blind_s_ = bytes_ > 0 ? blind_s_ + dt_s : 0;  // Silence is no evidence about the speed.
  if (bytes_ < kMinBytes || blind_s_ < (settled_ ? kDisturbed_s : kTry_s)) {
    return false;
  }
  searching_ = true;
  if (baud_ == known_baud_) {
    do {
      baud_ = kUsualBauds[next_];
      next_ = (next_ + 1) % kUsualBauds.size();
    } while (baud_ == known_baud_);
  } else {
    baud_ = known_baud_;
  }
  settled_ = false;
  bytes_ = 0;
  blind_s_ = 0;
  return true;
}

void BaudSearch::Reconnected() noexcept {
  settled_ = false;
  bytes_ = 0;
  blind_s_ = 0;
}

}  // namespace fulcrum::handle_bridge
