#include "services/transport/link/inbox.h"

#include <chrono>
#include <utility>

#include "services/base/runtime/cyclic_thread.h"

namespace fulcrum::link {
namespace {

constexpr std::size_t kLongestInbox = 4096;
// Bounds the memory of a side that receives more than it can take: half a second of a link of 1 Gbit/s.
constexpr std::size_t kLargestInbox_B = std::size_t{64} << 20;

}  // namespace

void Inbox::Put(bus::FarLane lane, std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  const bool full = content_.packets.size() >= kLongestInbox && lane == bus::FarLane::kStream;
  if (full || size_B_ + bytes.size() > kLargestInbox_B) {
    ++content_.overflowed;
    return;
  }
  size_B_ += bytes.size();
  content_.packets.push_back({lane, {bytes.begin(), bytes.end()}, now_ns});
  news_.notify_one();
}

void Inbox::Wake() {
  const std::lock_guard lock(mutex_);
  woken_ = true;
  news_.notify_one();
}

void Inbox::WaitUntil(std::int64_t due_ns) {
  std::unique_lock lock(mutex_);
  const std::int64_t rest = due_ns - runtime::MonotonicNs();
  if (rest > 0) {
    news_.wait_for(lock, std::chrono::nanoseconds(rest), [this] { return woken_ || !content_.packets.empty(); });
  }
  woken_ = false;
}

Inbox::Content Inbox::Take() {
  const std::lock_guard lock(mutex_);
  size_B_ = 0;
  return std::exchange(content_, {});
}

}  // namespace fulcrum::link
