// A serial link in memory.
#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "handle_bridge/serial/byte_link.h"

namespace fulcrum::handle_bridge {

/// A link in memory: bytes that the test adds are read at the next tick.
class MemoryLink final : public ByteLink {
 public:
  Result Read(std::span<char> buffer) noexcept override {
    const std::size_t n = std::min(buffer.size(), bytes.size());
    std::copy_n(bytes.begin(), n, buffer.begin());
    bytes.erase(0, n);
    const bool was_fresh = std::exchange(fresh, false);
    return {n, phase, was_fresh};
  }
  std::string_view unit() const noexcept override { return serial_number; }
  bool SetBaud(int new_baud) noexcept override {
    baud = new_baud;
    fresh = true;
    bytes.clear();
    return true;
  }
  std::string bytes;
  std::string serial_number;
  int baud = 115200;
  LinkPhase phase = LinkPhase::kOpen;
  bool fresh = true;
};

}  // namespace fulcrum::handle_bridge
