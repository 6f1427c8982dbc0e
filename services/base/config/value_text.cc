#include "services/base/config/value_text.h"

#include <charconv>
#include <cmath>
#include <limits>

namespace fulcrum::config::internal {

std::string Shortest(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string DefaultText(double value) {
  char text[32];
  const char* end = std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr;
  double rounded = 0;
  std::from_chars(text, end, rounded);
  const double float_rounding = std::numeric_limits<float>::epsilon() * std::abs(value);
  return std::abs(rounded - value) <= float_rounding ? Shortest(rounded) : Shortest(value);
}

std::string RangeText(const Range& range, const Unit* unit) {
  std::string text;
  if (std::isfinite(range.min) && std::isfinite(range.max)) {
    text = (range.min_open ? "above " : "") + Shortest(range.min) + (range.min_open ? " up to " : " to ") +
           Shortest(range.max);
  } else if (std::isfinite(range.min)) {
    text = (range.min_open ? "above " : "at least ") + Shortest(range.min);
  } else if (std::isfinite(range.max)) {
    text = "at most " + Shortest(range.max);
  } else {
    text = "any number";
  }
  return unit ? text + " " + std::string(unit->spelling) : text;
}

std::string CountText(std::size_t min_count, std::size_t max_count) {
  return (min_count == max_count ? "" : std::to_string(min_count) + " to ") + std::to_string(max_count);
}

std::string WordsText(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) {
    text += (text.empty() ? "" : ", ") + std::string(word);
  }
  return text;
}

const char* KindName(const Node& node) {
  switch (node.kind) {
    case NodeKind::kNull:
      return "nothing";
    case NodeKind::kScalar:
      return "a single value";
    case NodeKind::kList:
      return "a list";
    case NodeKind::kMap:
      return "a map";
  }
  return "?";
}

std::string Quoted(std::string_view text) {
  constexpr std::size_t kShown = 60;
  std::string quoted = "'";
  quoted += text.substr(0, kShown);
  quoted += text.size() > kShown ? "…'" : "'";
  return quoted;
}

}  // namespace fulcrum::config::internal
