// The recorder's input: samples of a topic as they were sent, neither decoded nor checked by the gate.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "services/base/core/messages.h"

namespace fulcrum::bus {

/// Identity of one writer of a topic; a restarted writer has another one.
using WriterGuid = std::array<std::uint8_t, 16>;

struct RawSample {
  TopicId topic = TopicId::kHealth;
  WriterGuid writer{};
  std::uint64_t sequence = 0;  ///< Of this writer, from 1, without gaps.
  std::int64_t source_ns = 0;  ///< CLOCK_REALTIME when it was written, as that clock was set then [ns].
  /// CLOCK_MONOTONIC of this machine when it was written [ns]. If the wall clock was set in between, time of arrival.
  std::int64_t written_ns = 0;
  /// CDR with its 4-byte encapsulation: `head`, then `body`.
  std::span<const std::byte> head, body;
};

/// Prefix of a metric in the recorder's Health, followed by the address of a participant: number of its matched
/// writers.
inline constexpr const char* kReadsMetric = "reads_";

/// The process behind a writer.
struct Peer {
  std::string name;  ///< DdsSettings.node_name; empty: not discovered.
  int pid = 0;
};

/// Receives samples, whose memory is valid during the call; called on threads of the bus, must be short and must not
/// throw.
using RawSink = std::function<void(const RawSample& sample)>;

/// Receives one topic from its construction to its destruction. Where the participant has `gathers` set, small samples
/// arrive up to 8 ms late, many at a time.
class RawInput {
 public:
  virtual ~RawInput() = default;
  [[nodiscard]] virtual bool matched() const noexcept = 0;
};

}  // namespace fulcrum::bus
