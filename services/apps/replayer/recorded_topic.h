// A topic of a recording, as a node that reads it would take it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "services/apps/replayer/session_facts.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {

/// The latest stamp that a sample can have that was recorded at `log_time_ns`: CLOCK_MONOTONIC [ns]. The two are
/// readings of two clocks.
[[nodiscard]] inline std::int64_t LatestStamp(const RecordedClock& clock, std::uint64_t log_time_ns) {
  constexpr std::int64_t kTolerance_ns = 1'000'000'000;
  return std::max<std::int64_t>(0, static_cast<std::int64_t>(log_time_ns) - clock.offset_ns + kTolerance_ns);
}

template <class T>
class RecordedTopic {
 public:
  /// The sample in `bytes`, until the next call; nullptr: no node would have taken it, because it is damaged, outside
  /// the gate, of a writer that another one had replaced, or later than `latest_ns`. One stamp of the far future would
  /// shut out all samples after it.
  [[nodiscard]] const T* Take(std::span<const std::uint8_t> bytes, std::int64_t latest_ns) {
    if (!bus::DecodeCdr(bytes, &sample_) || !bus::PassesGate(sample_)) return nullptr;
    const Stamp& stamp = bus::StampOf(sample_);
    return stamp.stamp_ns <= latest_ns && account_.IsOfOwner(stamp, latest_ns) ? &sample_ : nullptr;
  }

 private:
  T sample_;
  bus::InputAccount account_{false, bus::RoleOf<T>().one_owner()};
};

}  // namespace fulcrum::replay
