// Signed numbers of small magnitude as small unsigned ones.
#pragma once

#include <cstdint>

namespace fulcrum {

/// Maps 0, -1, 1, -2, … to 0, 1, 2, 3, …
[[nodiscard]] constexpr std::uint32_t Zigzag(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1) ^ static_cast<std::uint32_t>(value >> 31);
}
[[nodiscard]] constexpr std::int32_t Unzigzag(std::uint32_t value) {
  return static_cast<std::int32_t>(value >> 1) ^ -static_cast<std::int32_t>(value & 1u);
}

}  // namespace fulcrum
