// Bounded queue between exactly one producer thread and one consumer thread. Neither side ever waits, locks or
// allocates. A real-time loop exchanges data with the rest of its process through such a queue.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <type_traits>

namespace fulcrum::runtime {

/// T is copied in and out; its copy must not throw or allocate (Eigen does not declare it). The capacity is a power of
/// two and fully usable.
template <class T, std::size_t kCapacity>
class SpscRing {
  static_assert(kCapacity > 0 && (kCapacity & (kCapacity - 1)) == 0, "the capacity is a power of two");
  static_assert(std::is_copy_assignable_v<T>, "values are copied through");

 public:
  /// For the producer. False if full: the value was not stored.
  [[nodiscard]] bool TryPush(const T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);  // Only this thread writes head_.
    // Acquire: the consumer's copy out of the slot must be over before the slot is written again.
    if (head - tail_.load(std::memory_order_acquire) == kCapacity) return false;
    slots_[head & (kCapacity - 1)] = value;
    head_.store(head + 1, std::memory_order_release);  // Publishes the slot.
    return true;
  }

  /// For the consumer. False if empty.
  [[nodiscard]] bool TryPop(T* value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);   // Only this thread writes tail_.
    if (head_.load(std::memory_order_acquire) == tail) return false;  // Acquire: pairs with the producer's release.
    *value = slots_[tail & (kCapacity - 1)];
    tail_.store(tail + 1, std::memory_order_release);  // Returns the slot to the producer.
    return true;
  }

 private:
  static constexpr std::size_t kCacheLine = 64;
  // One cache line each, otherwise the two sides would slow each other down.
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};
  alignas(kCacheLine) std::array<T, kCapacity> slots_{};
};

}  // namespace fulcrum::runtime
