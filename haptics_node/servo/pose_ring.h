// Recent tip positions of the servo, over which a new model is replayed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "services/base/core/types.h"

namespace fulcrum::haptics {

struct TimedTip {
  std::int64_t stamp_ns = 0;
  Vec3d x = Vec3d::Zero();  ///< Tip of the device, not the proxy [m].
};

/// The last 256 ticks: 256 ms, well beyond the age at which forces have begun to fade.
class PoseRing {
 public:
  static constexpr std::size_t kCapacity = 256;

  void Push(std::int64_t stamp_ns, const Vec3d& x) noexcept {
    entries_[count_ % kCapacity] = {stamp_ns, x};
    ++count_;
  }
  [[nodiscard]] std::size_t size() const noexcept { return count_ < kCapacity ? count_ : kCapacity; }
  /// 0 is the newest. @pre age < size().
  [[nodiscard]] const TimedTip& Newest(std::size_t age) const noexcept {
    return entries_[(count_ - 1 - age) % kCapacity];
  }
  /// Number of entries taken after `stamp_ns`.
  [[nodiscard]] std::size_t CountAfter(std::int64_t stamp_ns) const noexcept {
    std::size_t n = 0;
    while (n < size() && Newest(n).stamp_ns > stamp_ns) ++n;
    return n;
  }

 private:
  std::array<TimedTip, kCapacity> entries_{};
  std::size_t count_ = 0;
};

}  // namespace fulcrum::haptics
