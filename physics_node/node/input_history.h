// The samples of one input around a point in time, so that a step uses those that were valid then instead of those that
// arrived last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "services/transport/bus/port.h"

namespace fulcrum::physics {

/// Unread samples kept at most: a tenth of a second of ToolState.
inline constexpr std::size_t kInputHistory = 128;

template <class T>
class InputHistory {
 public:
  /// Reads everything that has arrived.
  void Take(bus::Input<T>* port) {
    while (port->TakeNext(&sample_)) {
      // A restarted writer continues with the clock; a sample older than the newest one is of its predecessor.
      if (!samples_.empty() && sample_.stamp.stamp_ns <= samples_.back().stamp.stamp_ns) continue;
      samples_.push_back(sample_);
      if (samples_.size() > kInputHistory) samples_.pop_front();
    }
  }

  /// Drops the samples that are not needed from `ns` on: all before the newest one that is not later than `ns`.
  void DropBefore(std::int64_t ns) {
    while (samples_.size() > 1 && samples_[1].stamp.stamp_ns <= ns) samples_.pop_front();
  }

  [[nodiscard]] bool empty() const { return samples_.empty(); }
  /// After DropBefore(ns): the newest sample that is not later than ns, else the first sample. @pre not empty.
  [[nodiscard]] const T& before() const { return samples_.front(); }
  /// The sample after that; nullptr: none.
  [[nodiscard]] const T* after() const { return samples_.size() > 1 ? &samples_[1] : nullptr; }

 private:
  std::deque<T> samples_;
  T sample_;
};

}  // namespace fulcrum::physics
