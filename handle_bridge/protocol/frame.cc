#include "handle_bridge/protocol/frame.h"

#include <cstddef>

namespace fulcrum::handle_bridge {
namespace {

constexpr std::size_t kBodyBegin = 1, kBodySize = 8, kLineSize = 12;

constexpr std::array<std::uint8_t, 256> MakeCrcTable() {
  constexpr unsigned kPolynomial = 0x2F;
  std::array<std::uint8_t, 256> table{};
  for (unsigned byte = 0; byte < table.size(); ++byte) {
    unsigned crc = byte;
    for (int bit = 0; bit < 8; ++bit) {
      crc = crc & 0x80 ? crc << 1 ^ kPolynomial : crc << 1;
    }
    table[byte] = static_cast<std::uint8_t>(crc);
  }
  return table;
}

std::uint8_t Crc8(std::string_view bytes) {
  static constexpr std::array<std::uint8_t, 256> kTable = MakeCrcTable();
  std::uint8_t crc = 0xFF;
  for (const char byte : bytes) {
    crc = kTable[crc ^ static_cast<std::uint8_t>(byte)];
  }
  return crc ^ 0xFF;
}

std::optional<std::uint8_t> ParseHexByte(char high, char low) {
  const std::size_t h = kHexDigits.find(high), l = kHexDigits.find(low);
  if (h == std::string_view::npos || l == std::string_view::npos) {
    return {};
  }
  return static_cast<std::uint8_t>(16 * h + l);
}

}  // namespace

std::optional<Frame> ParseFrame(std::string_view line) noexcept {
  if (line.size() != kLineSize || line[0] != '$' || line[4] != ',' || line[9] != '*') {
    return {};
  }
  const std::optional<std::uint8_t> sequence = ParseHexByte(line[2], line[3]);
  const std::optional<std::uint8_t> crc = ParseHexByte(line[10], line[11]);
  const bool known_sender = line[1] == kLeftHandle || line[1] == kRightHandle || line[1] == kPedalSender;
  if (!known_sender || !sequence || !crc || *crc != Crc8(line.substr(kBodyBegin, kBodySize))) {
    return {};
  }
  Frame frame{line[1], *sequence, 0};
  for (const char digit : line.substr(5, 4)) {
    if (digit < '0' || digit > '9') {
      return {};
    }
    frame.value = 10 * frame.value + (digit - '0');
  }
  return frame;
}

std::array<char, 14> FormatFrame(const Frame& frame) noexcept {
  std::array<char, 14> line = {'$', frame.sender, '0', '0', ',', '0', '0', '0', '0', '*', '0', '0', '\r', '\n'};
  line[2] = kHexDigits[frame.sequence >> 4];
  line[3] = kHexDigits[frame.sequence & 15];
  int value = frame.value;
  for (std::size_t place = 8; place >= 5; --place) {
    line[place] = static_cast<char>('0' + value % 10);
    value /= 10;
  }
  const std::uint8_t crc = Crc8({line.data() + kBodyBegin, kBodySize});
  line[10] = kHexDigits[crc >> 4];
  line[11] = kHexDigits[crc & 15];
  return line;
}

}  // namespace fulcrum::handle_bridge
