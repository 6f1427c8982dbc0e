// Messages missing in a recording, found by the sequence numbers of their writers.
#pragma once

#include <cstdint>
#include <map>

#include "services/records/recording/mcap_reader.h"

namespace fulcrum::log_tools {

class SequenceGaps {
 public:
  /// Number of messages of the same writer that are missing between the previous call and this one.
  std::uint64_t Before(const recording::McapMessage& message) {
    const auto [last, is_first] = last_.try_emplace(message.channel, message.sequence);
    // Modulo 2^32: the numbers in a file are the low bits of those on the bus.
    const std::uint32_t step = message.sequence - last->second;
    last->second = message.sequence;
    return is_first || step == 0 ? 0 : step - 1;
  }

 private:
  std::map<std::uint16_t, std::uint32_t> last_;
};

}  // namespace fulcrum::log_tools
