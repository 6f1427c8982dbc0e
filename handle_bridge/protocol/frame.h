// The framed line of handles and foot pedal: sender, sequence number, value, checksum.
//
//   $ w ss , vvvv * cc CR LF        `$L1A,0503*29`: left handle, line 0x1A, code 503
//
//   w     sender: L and R the handles of the left and right hand, P the pedal
//   ss    sequence, 00 … FF and round again: what is missing was lost
//   vvvv  the converter's code, 0000 … 1023, or the pedal bits, 0000 … 0007
//   cc    CRC-8 of the eight characters between $ and *: polynomial 0x2F, start and final XOR 0xFF (AUTOSAR's): any two
//         flipped bits of a frame are found, and all but one in 10^5 of three
// Digits above 9 are capital letters. 14 bytes at 400 Hz are 49 % of 115200 8N1.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace fulcrum::handle_bridge {

inline constexpr char kLeftHandle = 'L';
inline constexpr char kRightHandle = 'R';
inline constexpr char kPedalSender = 'P';
inline constexpr std::string_view kHexDigits = "0123456789ABCDEF";

struct Frame {
  char sender = kLeftHandle;
  std::uint8_t sequence = 0;
  int value = 0;  ///< 0 … 9999.
};

/// True for a line that begins like a frame; a plain line of a handle or pedal never does.
[[nodiscard]] inline bool IsFramed(std::string_view line) noexcept { return line.starts_with('$'); }

/// Parses a line without its CR LF; no value unless it is a valid frame of a known sender.
[[nodiscard]] std::optional<Frame> ParseFrame(std::string_view line) noexcept;

/// Frame with CR LF.
[[nodiscard]] std::array<char, 14> FormatFrame(const Frame& frame) noexcept;

/// Counts lost frames by gaps in the sequence.
class SequenceCounter {
 public:
  /// Number of frames missing between the last one and this one, 0 … 255; 0 for the first frame.
  std::uint32_t Lost(std::uint8_t sequence) noexcept {
    const auto lost = seen_ ? static_cast<std::uint8_t>(sequence - last_ - 1) : std::uint8_t{0};
    seen_ = true;
    last_ = sequence;
    return lost;
  }

 private:
  bool seen_ = false;
  std::uint8_t last_ = 0;
};

}  // namespace fulcrum::handle_bridge
