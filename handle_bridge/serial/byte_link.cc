#include "handle_bridge/serial/byte_link.h"

#include <chrono>
#include <utility>

namespace fulcrum::handle_bridge {

ReconnectingLink::ReconnectingLink(std::unique_ptr<ByteSourceOpener> opener, int baud)
    : opener_(std::move(opener)), baud_(baud), thread_([this](const std::stop_token& stop) { Connect(stop); }) {}

ReconnectingLink::~ReconnectingLink() = default;

ByteLink::Result ReconnectingLink::Read(std::span<char> buffer) noexcept {
  Result result;
  if (!current_) {
    // The connecting thread holds the lock only to swap pointers. If it is held, the next tick retries.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock.owns_lock()) {
      current_ = std::move(fresh_);
      result.fresh = current_ != nullptr;
      phase_ = current_ ? LinkPhase::kOpen : searched_ ? LinkPhase::kReconnecting : phase_;
    }
  }
  if (current_) {
    const ReadResult read = current_->Read(buffer);
    result.bytes = read.bytes;
    if (read.hung_up) {
      const std::unique_lock lock(mutex_, std::try_to_lock);
      if (lock.owns_lock()) {
        dead_ = std::move(current_);  // Closing may take time, so it is left to the connecting thread.
        wanted_ = true;
        searched_ = false;
        phase_ = LinkPhase::kLost;
        wake_.notify_one();
      }
    }
  }
  result.phase = phase_;
  return result;
}

bool ReconnectingLink::SetBaud(int baud) noexcept {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock.owns_lock()) {
    return false;
  }
  baud_ = baud;
  if (std::unique_ptr<ByteSource>& open = current_ ? current_ : fresh_) {
    dead_ = std::move(open);
    wanted_ = true;
    searched_ = false;
    wake_.notify_one();
  }
  return true;
}

void ReconnectingLink::Connect(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    wake_.wait(lock, stop, [this] { return wanted_; });
    if (stop.stop_requested()) {
      return;
    }
    std::unique_ptr<ByteSource> dead = std::move(dead_);
    const int baud = baud_;
    lock.unlock();
    dead.reset();  // Closed before the new one is opened: some drivers allow one open handle per port only.
    std::unique_ptr<ByteSource> opened = opener_->Open(baud);
    lock.lock();
    if (opened && baud != baud_) {
      dead_ = std::move(opened);  // Another speed was requested meanwhile.
    } else if (opened) {
      fresh_ = std::move(opened);
      wanted_ = false;
    } else {
      searched_ = true;
      wake_.wait_for(lock, stop, std::chrono::milliseconds(kRetry_ms), [] { return false; });
    }
  }
}

}  // namespace fulcrum::handle_bridge
