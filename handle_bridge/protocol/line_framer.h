// Splits a byte stream into lines that end with CR LF. Memory is bounded: 16 bytes, also for garbage without line ends.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace fulcrum::handle_bridge {

class LineFramer {
 public:
  static constexpr std::size_t kMaxLineBytes = 16;  ///< The longest line, a frame, has 12 without CR LF.

  enum class Event {
    kNone,  ///< The line is not complete yet.
    kLine,  ///< line() holds a complete line, without CR LF, until the next Add.
    kBad,   ///< A line without CR before its LF, or 16 bytes without a line end.
  };

  Event Add(char byte) noexcept {
    if (byte == '\n') {
      const bool whole = !overlong_ && size_ > 0 && buffer_[size_ - 1] == '\r';
      line_size_ = whole ? size_ - 1 : 0;
      size_ = 0;
      const bool ends_reported_line = overlong_;
      overlong_ = false;
      if (whole) {
        return Event::kLine;
      }
      return ends_reported_line ? Event::kNone : Event::kBad;
    }
    if (size_ == kMaxLineBytes) {
      // Each 16 bytes count as one bad line, so that a stream without line ends is also recognised as garbage.
      size_ = 1;
      buffer_[0] = byte;
      overlong_ = true;
      return Event::kBad;
    }
    buffer_[size_++] = byte;
    return Event::kNone;
  }

  [[nodiscard]] std::string_view line() const noexcept { return {buffer_.data(), line_size_}; }

  /// Call after a reconnection: discards the incomplete line.
  void Reset() noexcept { *this = LineFramer(); }

 private:
  std::array<char, kMaxLineBytes> buffer_{};
  std::size_t size_ = 0;
  std::size_t line_size_ = 0;
  bool overlong_ = false;  ///< The current line has already been counted as bad.
};

}  // namespace fulcrum::handle_bridge
