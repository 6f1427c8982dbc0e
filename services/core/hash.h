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

/// Multiply-rotate over 8-byte words with SplitMix64's finaliser (Steele, Lea, Flood 2014). The bytes left over at the
/// end are folded in with the length, so that {1} and {1, 0} differ.
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

  /// The same for a long array, four words at a time: each word waits for the fourth before it and not for the last.
  /// Another value than Add's.
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void AddLong(std::span<const T> values) noexcept {
    const std::span<const std::byte> bytes = std::as_bytes(values);
    std::array<Hash64, 4> lanes;
    std::size_t i = 0;
    for (; i + 32 <= bytes.size(); i += 32) {
      std::array<std::uint64_t, 4> words;
      std::memcpy(words.data(), bytes.data() + i, 32);
      for (std::size_t lane = 0; lane < 4; ++lane) lanes[lane].Mix(words[lane]);
    }
    for (const Hash64& lane : lanes) Mix(lane.state_);
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
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
    return h ^ (h >> 31);
  }

 private:
  /// Invertible in the state for a given word and in the word for a given state: two inputs that differ in one word
  /// never meet.
  void Mix(std::uint64_t word) noexcept {
    state_ = std::rotl(state_ ^ (word * 0x9e3779b97f4a7c15ull), 27) * 0xbf58476d1ce4e5b9ull + 0x94d049bb133111ebull;
  }

  std::uint64_t state_ = 0xcbf29ce484222325ull;
};

}  // namespace fulcrum
