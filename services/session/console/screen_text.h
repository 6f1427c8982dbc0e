// What a program has written on its terminal, as lines. Pure.
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <string_view>

namespace fulcrum::console {

/// Understands line feed, carriage return and "clear the line"; leaves other control sequences out. Keeps the newest.
class ScreenText {
 public:
  static constexpr std::size_t kMostLines = 200;
  static constexpr std::size_t kLongestLine = 400;  ///< [B]

  void Add(std::string_view bytes);
  /// Lines joined by line feeds; the last is the one that is being written.
  [[nodiscard]] std::string Text() const;
  [[nodiscard]] const std::string& last() const { return lines_.back(); }

 private:
  void Put(char c);

  enum class Escape { kNone, kBegun, kSequence };
  std::deque<std::string> lines_{1};
  Escape escape_ = Escape::kNone;
  bool rewind_ = false;  ///< The next character begins the line anew.
};

/// With bytes that are no UTF-8 replaced by '?'.
[[nodiscard]] std::string ValidUtf8(std::string_view text);

}  // namespace fulcrum::console
