// The samples of one input around a moment, so that a step takes what was true then and not what happened to arrive
// last.
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
      // A writer that was started anew goes on with the clock; what is older than the newest came from its predecessor.
      if (!samples_.empty() && sample_.stamp.stamp_ns <= samples_.back().stamp.stamp_ns) continue;
      samples_.push_back(sample_);
      if (samples_.size() > kInputHistory) samples_.pop_front();
    }
  }

  /// Forgets what no moment from `ns` on needs: all before the newest sample that is not later than it.
  void Forget(std::int64_t ns) {
    while (samples_.size() > 1 && samples_[1].stamp.stamp_ns <= ns) samples_.pop_front();
  }

  [[nodiscard]] bool empty() const { return samples_.empty(); }
  /// After Forget(ns): the newest sample that is not later than ns, or the first one there is. @pre not empty.
  [[nodiscard]] const T& before() const { return samples_.front(); }
  /// The one after that; none: nullptr.
  [[nodiscard]] const T* after() const { return samples_.size() > 1 ? &samples_[1] : nullptr; }

 private:
  std::deque<T> samples_;
  T sample_;
};

}  // namespace fulcrum::physics
