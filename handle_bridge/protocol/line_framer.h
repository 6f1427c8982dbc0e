// Cuts a byte stream into lines ended by CR LF. Bounded: garbage without line ends costs 16 bytes of memory, no more.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace fulcrum::handle_bridge {

class LineFramer {
 public:
  static constexpr std::size_t kMaxLineBytes = 16;  ///< The longest line of any handle or pedal has 8.

  enum class Event {
    kNone,  ///< Nothing complete yet.
    kLine,  ///< line() holds a whole line, without CR LF, until the next Add.
    kBad,   ///< A line without CR before its LF, or 16 bytes without any end.
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
      // Each 16 bytes count as one bad line, so that an endless stream without line ends is seen as garbage too.
      size_ = 1;
      buffer_[0] = byte;
      overlong_ = true;
      return Event::kBad;
    }
    buffer_[size_++] = byte;
    return Event::kNone;
  }

  [[nodiscard]] std::string_view line() const noexcept { return {buffer_.data(), line_size_}; }

  /// After a reconnect: forgets the half line of the old connection.
  void Reset() noexcept { *this = LineFramer(); }

 private:
  std::array<char, kMaxLineBytes> buffer_{};
  std::size_t size_ = 0;
  std::size_t line_size_ = 0;
  bool overlong_ = false;  ///< The line under way has already been counted as bad.
};

}  // namespace fulcrum::handle_bridge
