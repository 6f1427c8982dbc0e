// Health of a node from the figures of its thread and ports. Pure: the caller passes the time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "services/base/core/messages.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/port.h"

namespace fulcrum::app {

/// Events per second over the last second of 10 Hz observations.
class RateMeter {
 public:
  /// Adds an observation and returns the rate [Hz] since the oldest observation that is at most a second old; 0 until
  /// there are two.
  [[nodiscard]] double Observe(std::int64_t now_ns, std::uint64_t count);

 private:
  struct Observation {
    std::int64_t time_ns;
    std::uint64_t count;
  };
  std::vector<Observation> recent_;
};

/// p50, p99 and maximum in µs.
[[nodiscard]] TimingSummary Summarise(const runtime::HistogramSnapshot& histogram);

class HealthReport {
 public:
  /// `period_ns`: nominal period of the node.
  HealthReport(NodeId node, std::int64_t period_ns, std::uint64_t schema_hash, std::uint64_t scene_hash,
               std::int32_t pid);

  using InputWatch = std::pair<TopicId, std::function<bus::InputStats()>>;
  using OutputWatch = std::function<bus::OutputStats()>;

  /// All fields except stamp, metrics and last_error, which the caller sets.
  [[nodiscard]] Health Make(std::int64_t now_ns, HealthState state, const runtime::CyclicStats& thread,
                            const std::vector<InputWatch>& inputs, const std::vector<OutputWatch>& outputs);

 private:
  Health base_;
  RateMeter rate_;
};

/// Name of a state: "starting", "running", …
[[nodiscard]] const char* StateName(HealthState state);

/// Cuts names, texts and lists to the capacity of the message, and sets metrics that are not finite to 0.
void FitToMessage(Health* health);

}  // namespace fulcrum::app
