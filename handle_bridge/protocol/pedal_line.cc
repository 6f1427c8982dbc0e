#include "handle_bridge/protocol/pedal_line.h"

namespace fulcrum::handle_bridge {
namespace {

constexpr std::string_view kHex = "0123456789ABCDEF";

}  // namespace

std::optional<std::uint8_t> ParsePedals(std::string_view line) noexcept {
  if (line.size() != 3 || line[0] != 'P') {
    return {};
  }
  const std::size_t bits = kHex.find(line[1]);
  if (bits > kAllPedals || line[2] != kHex[15 - bits]) {
    return {};
  }
  return static_cast<std::uint8_t>(bits);
}

std::array<char, 5> FormatPedals(std::uint8_t pedals) noexcept {
  const std::size_t bits = pedals & kAllPedals;
  return {'P', kHex[bits], kHex[15 - bits], '\r', '\n'};
}

}  // namespace fulcrum::handle_bridge
