// Streaming 64-bit hash for content and state. Not cryptographic.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

namespace fulcrum {

/// Multiply-rotate over 8-byte words with SplitMix64's finaliser (Steele, Lea, Flood 2014). The bytes left at the end
/// are mixed in together with the length, so that {1} and {1, 0} differ.
class Hash64 {
 public:
  void Add(std::span<const std::byte> bytes) noexcept {
    std::size_t i = 0;
    for (; i + 8 <= bytes.size(); i += 8) {
      std::uint64_t word;
      std::memcpy(&word, bytes.data() + i, 8);
      Mix(word);
    }
    std::uint64_t tail = 0;
    if (i < bytes.size()) {
      std::memcpy(&tail, bytes.data() + i, bytes.size() - i);
    }
    Mix(tail);
    Mix(bytes.size());
  }

  template <class T>
  requires std::is_trivially_copyable_v<T>
  void Add(std::span<const T> values) noexcept { Add(std::as_bytes(values)); }

  /// Adds a long array, eight words at a time: each word depends on the eighth before it and not on the previous one,
  /// and costs one multiplication. The hash differs from that of Add.
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void AddLong(std::span<const T> values) noexcept {
    const std::span<const std::byte> bytes = std::as_bytes(values);
    constexpr std::size_t kLanes = 8, kStride = 8 * kLanes;
    std::array<std::uint64_t, kLanes> lanes;
    lanes.fill(state_);
    std::size_t i = 0;
    for (; i + kStride <= bytes.size(); i += kStride) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        std::uint64_t word;
        std::memcpy(&word, bytes.data() + i + 8 * lane, 8);
        // Invertible in state and word, as Mix is.
        lanes[lane] = (std::rotl(lanes[lane], 27) ^ word) * kFirst;
      }
    }
    for (const std::uint64_t lane : lanes) Mix(lane);
    Add(bytes.subspan(i));
    Mix(bytes.size());
  }

  template <class T>
  requires std::is_arithmetic_v<T>
  void AddValue(T value) noexcept {
    std::uint64_t word = 0;
    std::memcpy(&word, &value, sizeof(T));
    Mix(word);
  }

  void Add(std::string_view text) noexcept { Add(std::as_bytes(std::span(text.data(), text.size()))); }

  [[nodiscard]] std::uint64_t value() const noexcept {
    std::uint64_t h = state_;
    h = (h ^ (h >> 30)) * kSecond;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
    return h ^ (h >> 31);
  }

 private:
  /// Invertible in the state for a given word and in the word for a given state: two inputs that differ in one word
  /// never have the same state.
  void Mix(std::uint64_t word) noexcept {
    state_ = std::rotl(state_ ^ (word * kFirst), 27) * kSecond + 0x94d049bb133111ebull;
  }

  static constexpr std::uint64_t kFirst = 0x9e3779b97f4a7c15ull, kSecond = 0xbf58476d1ce4e5b9ull;
  std::uint64_t state_ = 0xcbf29ce484222325ull;
};

}  // namespace fulcrum
