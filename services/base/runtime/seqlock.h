// Latest value of a state, written by one thread that must never wait and read by any number of threads that may retry.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace fulcrum::runtime {

/// Sequence lock after Boehm, "Can seqlocks get along with programming language memory models?" (2012): the payload is
/// atomic words, so a torn read is no data race and is retried. The words themselves provide the memory order, not
/// fences, which the thread sanitizer cannot follow; on x86 both cost nothing.
template <class T>
class SeqLock {
  static_assert(std::is_trivially_copyable_v<T>, "the payload is copied as words");

 public:
  /// For the single writer. Wait-free.
  void Store(const T& value) noexcept {
    std::array<std::uint64_t, kWords> words{};
    std::memcpy(words.data(), &value, sizeof(T));
    const std::uint64_t sequence = sequence_.load(std::memory_order_relaxed);
    sequence_.store(sequence + 1, std::memory_order_relaxed);  // Odd: being written.
    // Release: a reader that sees a new word also sees the odd mark.
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_release);
    sequence_.store(sequence + 2, std::memory_order_release);  // Even: the words above are complete.
  }

  /// For any thread. Retries during a write; the initial value is T{}.
  [[nodiscard]] T Load() const noexcept {
    std::array<std::uint64_t, kWords> words;
    for (;;) {
      const std::uint64_t before = sequence_.load(std::memory_order_acquire);  // Words are read after this.
      // Acquire: the second read of the sequence stays after these.
      for (std::size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(std::memory_order_acquire);
      if ((before & 1u) == 0 && sequence_.load(std::memory_order_relaxed) == before) break;
    }
    T value{};
    std::memcpy(static_cast<void*>(&value), words.data(), sizeof(T));
    return value;
  }

  SeqLock() noexcept { Store(T{}); }

 private:
  static constexpr std::size_t kWords = (sizeof(T) + 7) / 8;
  std::atomic<std::uint64_t> sequence_{0};
  std::array<std::atomic<std::uint64_t>, kWords> words_{};
};

}  // namespace fulcrum::runtime
