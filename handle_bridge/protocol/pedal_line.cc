#include "handle_bridge/protocol/pedal_line.h"

#include "handle_bridge/protocol/frame.h"

namespace fulcrum::handle_bridge {

std::optional<std::uint8_t> ParsePedals(std::string_view line) noexcept {
  if (line.size() != 3 || line[0] != 'P') {
    return {};
  }
  const std::size_t bits = kHexDigits.find(line[1]);
  if (bits > kAllPedals || line[2] != kHexDigits[15 - bits]) {
    return {};
  }
  return static_cast<std::uint8_t>(bits);
}

std::array<char, 5> FormatPedals(std::uint8_t pedals) noexcept {
  const std::size_t bits = pedals & kAllPedals;
  return {'P', kHexDigits[bits], kHexDigits[15 - bits], '\r', '\n'};
}

}  // namespace fulcrum::handle_bridge
