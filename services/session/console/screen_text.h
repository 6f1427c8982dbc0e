// The output of a program on a terminal as lines of text. Pure.
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <string_view>

namespace fulcrum::console {

/// Interprets line feed, carriage return and "clear the line", ignores other control sequences, and keeps the newest
/// lines.
class ScreenText {
 public:
  static constexpr std::size_t kMostLines = 200;
  static constexpr std::size_t kLongestLine = 400;  ///< [B]

  void Add(std::string_view bytes);
  /// Lines joined by line feeds; the last one may be incomplete.
  [[nodiscard]] std::string Text() const;
  [[nodiscard]] const std::string& last() const { return lines_.back(); }

 private:
  void Put(char c);

  enum class Escape { kNone, kBegun, kSequence };
  std::deque<std::string> lines_{1};
  Escape escape_ = Escape::kNone;
  bool rewind_ = false;  ///< The next character replaces the line.
};

/// `text` with each byte that is not valid UTF-8 replaced by '?'.
[[nodiscard]] std::string ValidUtf8(std::string_view text);

}  // namespace fulcrum::console
