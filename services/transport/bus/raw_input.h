// What a recorder sees of the bus: the samples of a topic as they travel, undecoded and ungated.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "services/base/core/messages.h"

namespace fulcrum::bus {

/// One writer of a topic: unlike any other, and unlike itself after a restart.
using WriterGuid = std::array<std::uint8_t, 16>;

struct RawSample {
  TopicId topic = TopicId::kHealth;
  WriterGuid writer{};
  std::uint64_t sequence = 0;  ///< Of this writer, from 1, without gaps.
  std::int64_t source_ns = 0;  ///< CLOCK_REALTIME when it was written, as that clock stood then [ns].
  /// CLOCK_MONOTONIC of this machine when it was written [ns]. When it arrived, if the wall clock was set on its way.
  std::int64_t written_ns = 0;
  /// CDR with its 4-byte encapsulation: `head`, then `body`.
  std::span<const std::byte> head, body;
};

/// Metric of the recorder's Health, with the address of a participant behind it: how many of its writers are matched.
inline constexpr const char* kReadsMetric = "reads_";

/// The process behind a writer.
struct Peer {
  std::string name;  ///< DdsSettings.node_name; empty: not heard of.
  int pid = 0;
};

/// Takes samples over; called on threads of the bus, must be short and must not throw. A sample of a large topic lies
/// in memory that its writer takes back some time: after it has been copied, `is_whole` says whether that was in time.
using RawSink = std::function<void(const RawSample& sample, const std::function<bool()>& is_whole)>;

/// Receives one topic from its making to its end. Where the participant lets them gather, small samples come up to 8 ms
/// late, many at a time.
class RawInput {
 public:
  virtual ~RawInput() = default;
  [[nodiscard]] virtual bool matched() const noexcept = 0;
};

}  // namespace fulcrum::bus
