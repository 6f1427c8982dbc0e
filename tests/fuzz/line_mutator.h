// Mutations of a text of `key: value` lines that mostly leave it well-formed: changes of bytes alone seldom get beyond
// the syntax of YAML.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace fulcrum::fuzz {

inline std::vector<std::string> LinesOf(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    lines.emplace_back(text.substr(0, end + 1));
    text.remove_prefix(end + 1);
  }
  return lines;
}

/// Replaces one value, removes, doubles, moves or indents a line. The same for the same `seed`.
[[nodiscard]] inline std::string MutateLines(std::string_view text, unsigned seed) {
  constexpr std::array<std::string_view, 24> kValues{
      "0",    "-1", "1",  "2",    "3",      "0.5", "1e300", "-1e-300", "nan",        "1e9",       "true", "null",
      "none", "[]", "{}", "\"\"", "[0, 1]", "'x'", "5 mm",  "300 um",  "2147483648", "simulated", "hook", "300"};
  std::minstd_rand random(seed);
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
  std::vector<std::string> lines = LinesOf(text);
  for (std::size_t edits = 1 + below(3); edits > 0 && !lines.empty(); --edits) {
    const auto at = static_cast<std::ptrdiff_t>(below(lines.size()));
    std::string& line = lines[static_cast<std::size_t>(at)];
    switch (below(8)) {
      case 0:
        lines.erase(lines.begin() + at);
        break;
      case 1:
        lines.insert(lines.begin() + at, std::string(line));
        break;
      case 2: {  // To another place, with or without the lines below it.
        std::string moved = std::move(line);
        lines.erase(lines.begin() + at);
        lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(below(lines.size() + 1)), std::move(moved));
        break;
      }
      case 3:
        line.insert(0, 2 * below(3), ' ');
        break;
      default: {  // One of its numbers, or all that follows a colon.
        std::size_t from = line.find_first_of("0123456789", below(line.size()));
        std::size_t end = line.find_first_not_of("0123456789.e-", from);
        if (from == std::string::npos || below(3) == 0) {
          const std::size_t colon = line.find(": ", below(line.size()));
          if (colon == std::string::npos) break;
          from = colon + 2;
          end = line.find_first_of(",}]\n", from);
        }
        if (end == std::string::npos) end = line.size();
        line.replace(from, end - from,
                     below(3) == 0 ? std::to_string(below(1000)) : std::string(kValues[below(kValues.size())]));
      }
    }
  }
  std::string all;
  for (const std::string& line : lines) all += line;
  return all;
}

}  // namespace fulcrum::fuzz
