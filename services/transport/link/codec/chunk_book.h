// What was sent in which chunk, and which chunks did not come. A lost chunk is never sent again as it was: what it told
// of is told again as it is now.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace fulcrum::link {

/// Block: the smallest part of a picture that is told by itself.
using BlockId = std::uint32_t;

/// The sender's side.
class SentChunks {
 public:
  /// Number of the chunk that begins now; from 1.
  [[nodiscard]] std::uint32_t Begin() {
    ++newest_;
    Of(newest_).clear();
    return newest_;
  }
  void Tell(BlockId block) { Of(newest_).push_back(block); }
  /// The blocks of a chunk; nullptr: too long ago, or not yet.
  [[nodiscard]] const std::vector<BlockId>* Find(std::uint32_t chunk) const {
    if (chunk == 0 || chunk > newest_ || newest_ - chunk >= kKept) return nullptr;
    return &ring_[chunk % kKept];
  }

 private:
  /// Over two seconds of tissue that moves as a whole.
  static constexpr std::uint32_t kKept = 4096;
  std::vector<BlockId>& Of(std::uint32_t chunk) { return ring_[chunk % kKept]; }
  std::vector<std::vector<BlockId>> ring_{kKept};
  std::uint32_t newest_ = 0;
};

/// The receiver's side.
class MissingChunks {
 public:
  void Note(std::uint32_t chunk) {
    if (newest_ == 0 && chunk > 1) all_ = true;  // What came before is not known one by one.
    if (chunk > newest_) {
      const std::uint32_t gap = newest_ == 0 ? 0 : chunk - newest_ - 1;
      lost_ += gap;
      if (gap > kMost - std::min(kMost, static_cast<std::uint32_t>(missing_.size()))) {
        all_ = true;
        missing_.clear();
      } else {
        for (std::uint32_t i = newest_ + 1; gap > 0 && i < chunk; ++i) missing_.push_back({i, 0});
      }
      newest_ = chunk;
    } else {
      lost_ -= static_cast<std::uint64_t>(std::erase_if(missing_, [&](const Missing& m) { return m.chunk == chunk; }));
    }
  }
  /// Everything is missing: a reader that has just come, or whose gaps were too many.
  [[nodiscard]] bool TakeAll() { return std::exchange(all_, false); }
  void AskForAll() { all_ = true; }
  /// The chunks to ask for now. Each is asked for twice, since the question may be lost as well.
  [[nodiscard]] std::vector<std::uint32_t> TakeQuestions(std::size_t most) {
    std::vector<std::uint32_t> asked;
    for (Missing& m : missing_) {
      if (asked.size() == most) break;
      asked.push_back(m.chunk);
      ++m.asked;
    }
    std::erase_if(missing_, [](const Missing& m) { return m.asked >= 2; });
    return asked;
  }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  static constexpr std::uint32_t kMost = 128;
  struct Missing {
    std::uint32_t chunk;
    int asked;
  };
  std::vector<Missing> missing_;
  std::uint32_t newest_ = 0;
  std::uint64_t lost_ = 0;
  bool all_ = true;
};

}  // namespace fulcrum::link
