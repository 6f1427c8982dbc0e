// The newest of a stream of values between exactly one producer thread and one consumer thread, both of which may be
// real-time loops: neither ever waits, retries, locks or allocates.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace fulcrum::runtime {

/// Three slots: one belongs to the producer, one to the consumer, and the third is exchanged. Unlike SeqLock's, the
/// consumer never retries: it may run at a higher priority than a producer that it has interrupted in mid-write.
template <class T>
class LatestValue {
  static_assert(std::is_copy_assignable_v<T>, "values are copied through");

 public:
  /// Producer.
  void Store(const T& value) noexcept {
    slots_[back_].value = value;
    // Release publishes the slot; acquire: the consumer's copy out of the slot that comes back is over.
    back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex;
  }

  /// Consumer. False when nothing was stored since the last time; `value` is then left alone.
  [[nodiscard]] bool TryTake(T* value) noexcept {
    // Relaxed: the exchange below is what orders; a mark that is missed now is found the next time.
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    *value = slots_[front_].value;
    return true;
  }

 private:
  static constexpr std::uint32_t kIndex = 3, kFresh = 4;
  static constexpr std::size_t kCacheLine = 64;
  struct alignas(kCacheLine) Slot {
    T value{};
  };
  std::array<Slot, 3> slots_{};
  alignas(kCacheLine) std::uint32_t back_ = 0;   ///< Producer's.
  alignas(kCacheLine) std::uint32_t front_ = 1;  ///< Consumer's.
  alignas(kCacheLine) std::atomic<std::uint32_t> middle_{2};
};

}  // namespace fulcrum::runtime
