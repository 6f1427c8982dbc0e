// Numbers as hexadecimal text.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <string>

namespace fulcrum::bus {

/// The number as sixteen digits.
[[nodiscard]] inline std::string Hex(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

}  // namespace fulcrum::bus
