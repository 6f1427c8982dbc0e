// Maps the epochs of processes on the other host to epochs on this host.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::link {

/// An epoch is the time at which a writer started; of two writers, readers accept the one with the later epoch. If the
/// epoch were shifted by the clock offset, it would change with each change of the estimate, and would decrease when
/// the link restarts with a lower estimate. Therefore the epoch on our bus is the time at which the first sample of the
/// process was received: it grows with each restart of the process and of the link.
class EpochMap {
 public:
  /// @param one_owner the topic has one owner: an epoch below the newest belongs to a replaced process and gives
  /// nothing.
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
  /// Inverse of ToOurs; an epoch that ToOurs did not return is returned unchanged.
  [[nodiscard]] std::uint64_t ToTheirs(TopicId topic, std::uint64_t ours) const {
    for (const Known& k : by_topic_[static_cast<std::size_t>(topic)]) {
      if (k.ours == ours) return k.theirs;
    }
    return ours;
  }

 private:
  static constexpr std::size_t kMost = 16;  ///< The number of writers that a reader distinguishes.
  struct Known {
    std::uint64_t theirs, ours;
  };
  std::array<std::vector<Known>, kTopicCount> by_topic_;
  std::uint64_t newest_ = 0;
};

}  // namespace fulcrum::link
