// Facts on cart and session that all kinds of replay need.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/recorded_scene.h"

namespace fulcrum::replay {

/// Nominal period by node [s], in whole nanoseconds, as the cyclic thread counts.
[[nodiscard]] inline std::array<double, kNodeCount> NodePeriods(const config::CartConfig& cart) {
  std::array<double, kNodeCount> period_s{};
  for (const NodeId node : {NodeId::kHandleBridge, NodeId::kHaptics, NodeId::kPhysics, NodeId::kThermal}) {
    period_s[static_cast<std::size_t>(node)] = 1e-9 * std::round(1e9 / cart.timing(node).rate_Hz);
  }
  return period_s;
}

/// Log times are wall-clock times; the recorder has stored their offset from the clock of the stamps [ns].
[[nodiscard]] inline std::int64_t ClockOffset(const recording::McapReader& reader) {
  const auto clock = reader.metadata().find("clock");
  if (clock == reader.metadata().end()) return 0;
  const auto offset = clock->second.find("log_time_minus_monotonic_ns");
  return offset == clock->second.end() ? 0 : std::strtoll(offset->second.c_str(), nullptr, 10);
}

struct RecordedClock {
  std::int64_t offset_ns;  ///< ClockOffset().
  std::int64_t last_ns;    ///< Log time of the last message on the clock of the stamps [ns].
};

/// Reads the heads of the chunks only. Throws InputError.
[[nodiscard]] inline RecordedClock ClockOf(const std::filesystem::path& recording) {
  recording::McapReader reader(recording, recording::McapReader::Depth::kChunkHeads);
  for (recording::McapMessage none{}; reader.Next(&none);) {
  }
  const std::int64_t offset_ns = ClockOffset(reader);
  return {offset_ns, static_cast<std::int64_t>(reader.last_ns()) - offset_ns};
}

using recording::RefuseOtherScene;

}  // namespace fulcrum::replay
