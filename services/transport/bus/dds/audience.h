// Which participants read the writers of this one. Internal to services/transport/bus/dds.
#pragma once

#include <fastdds/rtps/common/Guid.h>

#include <algorithm>
#include <map>
#include <mutex>

namespace fulcrum::bus::dds {

class Audience {
 public:
  using Prefix = eprosima::fastrtps::rtps::GuidPrefix_t;

  /// @param writer any address that is its own.
  void Add(const void* writer) {
    const std::lock_guard lock(mutex_);
    readers_[writer];
  }
  void Remove(const void* writer) {
    const std::lock_guard lock(mutex_);
    readers_.erase(writer);
  }
  /// A reader of that participant was matched (1), or is no longer (-1).
  void Count(const void* writer, const Prefix& prefix, int change) {
    const std::lock_guard lock(mutex_);
    readers_[writer][prefix] += change;
  }
  /// Whether every writer has a reader in that participant.
  [[nodiscard]] bool Reaches(const Prefix& prefix) const {
    const std::lock_guard lock(mutex_);
    return std::all_of(readers_.begin(), readers_.end(), [&](const auto& writer) {
      const auto found = writer.second.find(prefix);
      return found != writer.second.end() && found->second > 0;
    });
  }

 private:
  mutable std::mutex mutex_;
  std::map<const void*, std::map<Prefix, int>> readers_;
};

}  // namespace fulcrum::bus::dds
