// Epochs of processes on the other host, as they are on ours.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::link {

/// An epoch is the time at which a writer began, and readers take the later of two for the owner. Moved by the clock
/// offset, the same writer would be another one whenever the estimate changes by a nanosecond, and older than itself
/// when the link comes back with a lower estimate. So the epoch on our bus is the time at which we first heard of the
/// process: it grows with each restart of the process and with each of ours.
class EpochMap {
 public:
  /// @param one_owner an epoch below the newest is that of a process that has been replaced: nothing.
  [[nodiscard]] std::optional<std::uint64_t> ToOurs(TopicId topic, std::uint64_t theirs, bool one_owner,
                                                    std::int64_t now_ns) {
    std::vector<Known>& known = by_topic_[static_cast<std::size_t>(topic)];
    for (const Known& k : known) {
      if (k.theirs == theirs) return k.ours;
    }
    if (one_owner && !known.empty() && theirs < known.back().theirs) return std::nullopt;
    if (known.size() == kMost) known.erase(known.begin());
    newest_ = std::max(newest_ + 1, static_cast<std::uint64_t>(now_ns));
    known.push_back({theirs, newest_});
    return newest_;
  }
  /// The epoch on the other host of one that ToOurs gave; any other as it is.
  [[nodiscard]] std::uint64_t ToTheirs(TopicId topic, std::uint64_t ours) const {
    for (const Known& k : by_topic_[static_cast<std::size_t>(topic)]) {
      if (k.ours == ours) return k.theirs;
    }
    return ours;
  }

 private:
  static constexpr std::size_t kMost = 16;  ///< As many writers as a reader tells apart.
  struct Known {
    std::uint64_t theirs, ours;
  };
  std::array<std::vector<Known>, kTopicCount> by_topic_;
  std::uint64_t newest_ = 0;
};

}  // namespace fulcrum::link
