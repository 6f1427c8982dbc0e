// The foot pedal's line protocol, on a link of its own, because the paper's handle line has no field for it.
//
//   P h c CR LF      h: pedal bits as one hexadecimal digit, c: its complement (15 - h), for example `P1E` = cut.
//
// or, with sequence and checksum, the frame of frame.h with the bits as its value. Sent immediately when a pedal moves
// and every 20 ms otherwise. The complement detects a damaged digit; silence for 200 ms counts as all pedals released,
// because the generator must not stay on after a wire has broken.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace fulcrum::handle_bridge {

inline constexpr double kPedalPeriod_s = 0.02;
inline constexpr double kPedalTimeout_s = 0.2;
inline constexpr std::uint8_t kAllPedals = 7;  ///< kPedalCut | kPedalCoag | kPedalBlend

/// Pedal bits of a plain line without its CR LF; no value for any other text.
[[nodiscard]] std::optional<std::uint8_t> ParsePedals(std::string_view line) noexcept;

/// Plain line with CR LF.
[[nodiscard]] std::array<char, 5> FormatPedals(std::uint8_t pedals) noexcept;

}  // namespace fulcrum::handle_bridge
