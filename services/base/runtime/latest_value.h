// The newest of a stream of values between exactly one producer thread and one consumer thread, both of which may be
// real-time loops: neither ever waits, retries, locks or allocates.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace fulcrum::runtime {

/// Three slots: one belongs to the producer, one to the consumer, and the third is exchanged. Unlike the reader of a
/// SeqLock, the consumer never retries: it may run at a higher priority than a producer that it has preempted during a
/// write.
template <class T>
class LatestValue {
  static_assert(std::is_copy_assignable_v<T>, "values are copied through");

 public:
  /// For the producer.
  void Store(const T& value) noexcept {
    slots_[back_].value = value;
    // Release publishes the slot; acquire: the consumer has finished copying from the slot that is returned.
    back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex;
  }

  /// For the consumer. False if nothing was stored since the last call; `value` is then unchanged.
  [[nodiscard]] bool TryTake(T* value) noexcept {
    // Relaxed: the exchange below provides the order; a mark that is missed now is found by the next call.
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
  alignas(kCacheLine) std::uint32_t back_ = 0;   ///< Slot of the producer.
  alignas(kCacheLine) std::uint32_t front_ = 1;  ///< Slot of the consumer.
  alignas(kCacheLine) std::atomic<std::uint32_t> middle_{2};
};

}  // namespace fulcrum::runtime
