// Little-endian numbers and strings in bytes.
#pragma once

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum {

static_assert(std::endian::native == std::endian::little);

/// Appends numbers and strings to a vector.
class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::uint8_t>* out) : out_(out) {}

  template <std::integral T>
  void Number(T value) {
    Bytes(&value, sizeof value);
  }
  void Text(std::string_view text) {
    Number(static_cast<std::uint32_t>(text.size()));
    Bytes(text.data(), text.size());
  }
  void Texts(const std::map<std::string, std::string>& map) {
    Sized<std::uint32_t>([&] {
      for (const auto& [key, value] : map) {
        Text(key);
        Text(value);
      }
    });
  }
  void Bytes(const void* data, std::size_t size) {
    const auto* const begin = static_cast<const std::uint8_t*>(data);
    out_->insert(out_->end(), begin, begin + size);
  }
  /// Appends the output of `put`, preceded by its length in bytes.
  template <std::integral Length, class Put>
  void Sized(const Put& put) {
    const std::size_t at = out_->size();
    Number(Length{0});
    put();
    const auto length = static_cast<Length>(out_->size() - at - sizeof(Length));
    std::memcpy(out_->data() + at, &length, sizeof length);
  }
  /// Appends the output of `put` as a record: a byte that names its kind, its length as 64 bits, its content.
  template <class Opcode, class Put>
  void Record(Opcode opcode, const Put& put) {
    Number(static_cast<std::uint8_t>(opcode));
    Sized<std::uint64_t>(put);
  }

 private:
  std::vector<std::uint8_t>* out_;
};

/// Reads numbers and strings from a span. Reading beyond its end returns 0 or empty, and good() is false from then on.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <std::integral T>
  T Number() {
    T value{};
    const std::span<const std::uint8_t> from = Take(sizeof value);
    if (good_) std::memcpy(&value, from.data(), sizeof value);
    return value;
  }
  std::string Text() {
    const std::span<const std::uint8_t> from = Take(Number<std::uint32_t>());
    return {from.begin(), from.end()};
  }
  std::map<std::string, std::string> Texts() {
    ByteReader pairs(Take(Number<std::uint32_t>()));
    std::map<std::string, std::string> map;
    while (pairs.good_ && !pairs.bytes_.empty()) {
      std::string key = pairs.Text();
      map[std::move(key)] = pairs.Text();
    }
    good_ = good_ && pairs.good_;
    return map;
  }
  std::span<const std::uint8_t> Take(std::uint64_t size) {
    good_ = good_ && size <= bytes_.size();
    if (!good_) return {};
    const std::span<const std::uint8_t> taken = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return taken;
  }
  std::span<const std::uint8_t> Rest() { return Take(bytes_.size()); }
  [[nodiscard]] bool good() const { return good_; }
  [[nodiscard]] bool empty() const { return bytes_.empty(); }

 private:
  std::span<const std::uint8_t> bytes_;
  bool good_ = true;
};

}  // namespace fulcrum
