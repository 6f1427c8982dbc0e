// What is missing in a recording, by the numbers that its writers gave.
#pragma once

#include <cstdint>
#include <map>

#include "services/records/recording/mcap_reader.h"

namespace fulcrum::log_tools {

class SequenceGaps {
 public:
  /// Messages of the same writer that are missing between the last call and this one.
  std::uint64_t Before(const recording::McapMessage& message) {
    const auto [last, is_first] = last_.try_emplace(message.channel, message.sequence);
    // Modulo 2^32: the numbers of a file are the low bits of the bus's.
    const std::uint32_t step = message.sequence - last->second;
    last->second = message.sequence;
    return is_first || step == 0 ? 0 : step - 1;
  }

 private:
  std::map<std::uint16_t, std::uint32_t> last_;
};

}  // namespace fulcrum::log_tools
