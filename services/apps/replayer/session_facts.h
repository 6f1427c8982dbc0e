// Facts on cart and session that all kinds of replay need.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "services/base/config/cart.h"
#include "services/base/core/error.h"
#include "services/base/core/messages.h"
#include "services/records/recording/mcap_reader.h"
#include "services/records/recording/recorded_scene.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {

/// Nominal period by node [s], in whole nanoseconds, as the cyclic thread counts; 0 for a node without a rate.
[[nodiscard]] inline std::array<double, kNodeCount> NodePeriods(const config::CartConfig& cart) {
  std::array<double, kNodeCount> period_s{};
  for (std::size_t node = 0; node < period_s.size(); ++node) {
    const double rate_Hz = cart.timing(static_cast<NodeId>(node)).rate_Hz;
    if (rate_Hz > 0) period_s[node] = 1e-9 * std::round(1e9 / rate_Hz);
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
  /// Log times on the clock of the stamps [ns]: of the first TissueFrame, and of the last TissueFrame or ToolState. The
  /// recorder and the supervisor write messages before and after. Of all messages in a file without message indexes.
  std::int64_t first_shown_ns, last_shown_ns;
};

/// Reads the heads of the chunks and their indexes only. Throws InputError.
[[nodiscard]] inline RecordedClock ClockOf(const std::filesystem::path& recording) {
  recording::McapReader reader(recording, recording::McapReader::Depth::kChunkHeads);
  for (recording::McapMessage none{}; reader.Next(&none);) {
  }
  std::optional<std::uint64_t> first_ns, last_ns;
  for (const auto& [number, span] : reader.spans()) {
    const auto channel = reader.channels().find(number);
    if (channel == reader.channels().end()) continue;
    const bool tissue = channel->second.topic == bus::RoleOf<TissueFrame>().name;
    if (!tissue && channel->second.topic != bus::RoleOf<ToolState>().name) continue;
    if (tissue) first_ns = std::min(span.first_ns, first_ns.value_or(span.first_ns));
    last_ns = std::max(span.last_ns, last_ns.value_or(span.last_ns));
  }
  const std::int64_t offset_ns = ClockOffset(reader);
  return {offset_ns, static_cast<std::int64_t>(first_ns.value_or(reader.first_ns())) - offset_ns,
          static_cast<std::int64_t>(last_ns.value_or(reader.last_ns())) - offset_ns};
}

/// What a recording shows, session time [s].
struct RecordedSpan {
  double begin_s = 0;  ///< 0 unless the recording begins late, as the second file of a recorder does.
  double end_s = 0;
};

/// Throws InputError for an end that no session has.
[[nodiscard]] inline RecordedSpan SpanOf(const std::filesystem::path& recording, const RecordedClock& clock,
                                         std::int64_t session_start_ns) {
  constexpr double kLate_s = 0.5;                 // The first tissue of a session comes some steps after its begin.
  constexpr double kLongest_s = 7 * 24 * 3600.0;  // As of fulcrum up.
  const auto time_s = [&](std::int64_t ns) { return std::max(0.0, 1e-9 * static_cast<double>(ns - session_start_ns)); };
  const RecordedSpan span{time_s(clock.first_shown_ns), time_s(clock.last_shown_ns)};
  if (span.end_s > kLongest_s) {
    throw InputError(recording.string() + ": ends at session time " + std::to_string(span.end_s) +
                     " s; has another program removed its metadata \"clock\"?");
  }
  return {span.begin_s > kLate_s ? std::min(span.begin_s, span.end_s) : 0, span.end_s};
}

/// Numbers of the pictures, one each `step_s` of session time, from begin to end or to `until_s` (negative: the end).
/// Throws InputError, which names the recording, where it begins after `until_s`.
struct PictureNumbers {
  PictureNumbers(const std::filesystem::path& recording, const RecordedSpan& span, double until_s, double step_s) {
    constexpr double kRounding = 1e-6;  // Steps.
    const double end_s = until_s >= 0 ? std::min(until_s, span.end_s) : span.end_s;
    const double from = std::ceil(span.begin_s / step_s - kRounding), to = std::floor(end_s / step_s + kRounding);
    if (to < from) {
      throw InputError(recording.string() + ": shows session times " + std::to_string(span.begin_s) + " to " +
                       std::to_string(span.end_s) +
                       " s, of which none is to be drawn; give a later --until or shorter "
                       "steps, or join the parts of the session with fulcrum log merge");
    }
    first = static_cast<std::uint64_t>(from);
    count = static_cast<std::uint64_t>(to - from) + 1;
  }
  std::uint64_t first = 0, count = 0;
};

using recording::RefuseOtherScene;

}  // namespace fulcrum::replay
