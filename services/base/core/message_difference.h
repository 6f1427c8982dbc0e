// First difference of two messages: field, index and both values, as text.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "services/base/core/message_fields.h"

namespace fulcrum {

struct Difference {
  std::string field;          ///< For example "devices[0].contacts[1].f_ref[2]".
  std::string first, second;  ///< The values; floating point with all its digits.
};

namespace difference {

template <class T>
std::string TextOf(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return std::to_string(static_cast<long long>(value));
  } else if constexpr (std::is_floating_point_v<T>) {
    char text[40];
    std::snprintf(text, sizeof(text), sizeof(T) == sizeof(float) ? "%.9g" : "%.17g", static_cast<double>(value));
    return text;
  } else if constexpr (std::is_convertible_v<T, std::string_view>) {
    return '"' + std::string(value) + '"';
  } else {
    return std::to_string(value);
  }
}

/// Compares by bits, so a NaN equals itself.
template <class T>
bool SameBits(T a, T b) {
  if constexpr (std::is_floating_point_v<T>) {
    using Bits = std::conditional_t<sizeof(T) == sizeof(std::uint32_t), std::uint32_t, std::uint64_t>;
    return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
  } else {
    return a == b;
  }
}

template <class T>
std::optional<Difference> Find(const T& a, const T& b, const std::string& path, std::string_view without);

template <class Range>
std::optional<Difference> FindInRange(const Range& a, const Range& b, const std::string& path) {
  const auto size_a = static_cast<std::size_t>(a.size()), size_b = static_cast<std::size_t>(b.size());
  if (size_a != size_b) return Difference{path + ".size", std::to_string(size_a), std::to_string(size_b)};
  for (std::size_t i = 0; i < size_a; ++i) {
    // Names are built for differing elements only: a frame has tens of thousands of numbers.
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(a[i])>>) {
      if (SameBits(a[i], b[i])) continue;
    }
    if (auto found = Find(a[i], b[i], path + "[" + std::to_string(i) + "]", {})) return found;
  }
  return std::nullopt;
}

template <class T>
std::optional<Difference> Find(const T& a, const T& b, const std::string& path, std::string_view without) {
  if constexpr (HasFields<T>) {
    std::optional<Difference> found;
    ForEachField<T>([&](const char* name, auto member) {
      if (found || (!without.empty() && without == name)) return;
      found = Find(a.*member, b.*member, path.empty() ? std::string(name) : path + "." + name, without);
    });
    return found;
  } else if constexpr (std::is_same_v<T, Quatf>) {
    return FindInRange(a.coeffs(), b.coeffs(), path);
  } else if constexpr (std::is_same_v<T, std::string>) {
    return a == b ? std::nullopt : std::optional(Difference{path, TextOf(a), TextOf(b)});
  } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
    if (SameBits(a, b)) return std::nullopt;
    return Difference{path, TextOf(a), TextOf(b)};
  } else {
    return FindInRange(a, b, path);
  }
}

}  // namespace difference

/// The first field, in the order of the struct, in which the bits differ. @param without name of a field that is
/// skipped at any depth, for example "stamp".
template <HasFields T>
[[nodiscard]] std::optional<Difference> FirstDifference(const T& a, const T& b, std::string_view without = {}) {
  return difference::Find(a, b, {}, without);
}

}  // namespace fulcrum
