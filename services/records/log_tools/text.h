// Messages as text: JSON and table cells. Names and order are those of services/base/core/message_fields.h.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "services/base/core/json_text.h"
#include "services/base/core/message_fields.h"

namespace fulcrum::log_tools {

/// `longest`: a longer list of numbers is cut to this length and ends in a string with the number of omitted ones.
template <class T>
void PutJson(const T& value, std::size_t longest, std::string* out);

namespace text {

template <class T>
inline constexpr bool kIsList = false;
template <class T>
inline constexpr bool kIsList<std::vector<T>> = true;

/// A unit quaternion in the order of the topics: (w, x, y, z).
inline std::array<float, 4> InOrder(const Quatf& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// Shortest text that is read back as the same number. JSON has no representation of values that are not finite.
template <class T>
void PutNumber(T value, std::string* out) {
  if constexpr (std::is_same_v<T, bool>) {
    *out += value ? "true" : "false";
  } else if constexpr (std::is_enum_v<T>) {
    PutNumber(static_cast<std::underlying_type_t<T>>(value), out);
  } else {
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(value)) {
        *out += "null";
        return;
      }
    }
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    out->append(digits.data(), end);
  }
}

template <class Range>
void PutList(const Range& range, std::size_t longest, std::string* out) {
  const auto size = static_cast<std::size_t>(range.size());
  *out += '[';
  for (std::size_t i = 0; i < size && i < longest; ++i) {
    if (i > 0) *out += ',';
    PutJson(range[i], longest, out);
  }
  if (size > longest) *out += ",\"" + std::to_string(size - longest) + " more\"";
  *out += ']';
}

}  // namespace text

template <class T>
void PutJson(const T& value, std::size_t longest, std::string* out) {
  if constexpr (HasFields<T>) {
    char before = '{';
    ForEachField<T>([&](const char* name, auto member) {
      *out += before;
      before = ',';
      *out += '"';
      *out += name;
      *out += "\":";
      PutJson(value.*member, longest, out);
    });
    *out += '}';
  } else if constexpr (std::is_same_v<T, Quatf>) {
    text::PutList(text::InOrder(value), longest, out);
  } else if constexpr (std::is_same_v<T, std::string>) {
    *out += JsonString(value);
  } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
    text::PutNumber(value, out);
  } else {
    text::PutList(value, longest, out);
  }
}

/// Calls leaf(path, text) for each number or name, for example ("tools[0].p_WT[2]", "0.1"), with the same paths for
/// every message of a type. A list of variable length is one leaf, as JSON.
template <class T, class Leaf>
void ForEachLeaf(const T& value, const std::string& path, std::size_t longest, const Leaf& leaf) {
  const auto each = [&](const auto& range) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(range.size()); ++i) {
      ForEachLeaf(range[i], path + "[" + std::to_string(i) + "]", longest, leaf);
    }
  };
  if constexpr (HasFields<T>) {
    ForEachField<T>([&](const char* name, auto member) {
      ForEachLeaf(value.*member, path.empty() ? std::string(name) : path + "." + name, longest, leaf);
    });
  } else if constexpr (std::is_same_v<T, Quatf>) {
    each(text::InOrder(value));
  } else if constexpr (std::is_same_v<T, std::string>) {
    leaf(path, value);
  } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T> || text::kIsList<T>) {
    std::string text;
    PutJson(value, longest, &text);
    leaf(path, text);
  } else {
    each(value);
  }
}

}  // namespace fulcrum::log_tools
