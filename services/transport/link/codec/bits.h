// Small whole numbers in few bits: variable length, and values of one width packed tightly.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/base/core/byte_stream.h"
#include "services/base/core/zigzag.h"

namespace fulcrum::link {

/// Appends seven bits per byte, the low ones first; the high bit of a byte means that more bytes follow.
inline void PutVarint(std::uint32_t value, std::vector<std::uint8_t>* out) {
  for (; value >= 0x80u; value >>= 7) out->push_back(static_cast<std::uint8_t>(value | 0x80u));
  out->push_back(static_cast<std::uint8_t>(value));
}
/// Reads a number of PutVarint. Returns 0 and leaves `in` not good() if the number is cut short or longer than 32 bits.
[[nodiscard]] inline std::uint32_t TakeVarint(ByteReader* in) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 35; shift += 7) {
    const auto byte = in->Number<std::uint8_t>();
    if (!in->good()) return 0;
    value |= static_cast<std::uint64_t>(byte & 0x7fu) << shift;
    if ((byte & 0x80u) == 0) {
      if (value >> 32 != 0) break;
      return static_cast<std::uint32_t>(value);
    }
  }
  (void)in->Take(~std::uint64_t{0});  // More than any input contains, so this makes the reader not good().
  return 0;
}

/// Appends each value in `width` bits (0 to 32) and fills the last byte up with zeros.
inline void PutBits(std::span<const std::uint32_t> values, int width, std::vector<std::uint8_t>* out) {
  std::uint64_t pending = 0;
  int bits = 0;
  for (const std::uint32_t value : values) {
    pending |= static_cast<std::uint64_t>(value) << bits;
    for (bits += width; bits >= 8; bits -= 8, pending >>= 8) out->push_back(static_cast<std::uint8_t>(pending));
  }
  if (bits > 0) out->push_back(static_cast<std::uint8_t>(pending));
}
/// Reads `values.size()` numbers of `width` bits. False if the input contains too few bytes.
[[nodiscard]] inline bool TakeBits(ByteReader* in, int width, std::span<std::uint32_t> values) {
  const std::span<const std::uint8_t> bytes = in->Take((values.size() * static_cast<std::size_t>(width) + 7) / 8);
  if (!in->good()) return false;
  const std::uint64_t mask = (std::uint64_t{1} << width) - 1;
  std::uint64_t pending = 0;
  int bits = 0;
  std::size_t at = 0;
  for (std::uint32_t& value : values) {
    for (; bits < width; bits += 8) pending |= static_cast<std::uint64_t>(bytes[at++]) << bits;
    value = static_cast<std::uint32_t>(pending & mask);
    pending >>= width;
    bits -= width;
  }
  return true;
}
/// Number of bits that the largest value needs.
[[nodiscard]] inline int WidthOf(std::span<const std::uint32_t> values) {
  std::uint32_t all = 0;
  for (const std::uint32_t value : values) all |= value;
  return std::bit_width(all);
}

}  // namespace fulcrum::link
