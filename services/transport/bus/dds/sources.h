// The participants whose writers are matched with the raw inputs of this one. Internal to services/transport/bus/dds.
#pragma once

#include <fastdds/rtps/common/Guid.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>

namespace fulcrum::bus::dds {

class Sources {
 public:
  using Prefix = eprosima::fastrtps::rtps::GuidPrefix_t;
  struct Match {
    int writers = 0;
    std::int64_t since_ns = 0;  ///< CLOCK_MONOTONIC of the first match.
  };

  /// Counts a writer of that participant that was matched (1) or removed (-1).
  void Count(const Prefix& prefix, int change) {
    const std::lock_guard lock(mutex_);
    Match& match = matches_[prefix];
    if (match.since_ns == 0) match.since_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    match.writers += change;
    if (match.writers <= 0) matches_.erase(prefix);
  }
  [[nodiscard]] std::map<Prefix, Match> matches() const {
    const std::lock_guard lock(mutex_);
    return matches_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<Prefix, Match> matches_;
};

}  // namespace fulcrum::bus::dds
