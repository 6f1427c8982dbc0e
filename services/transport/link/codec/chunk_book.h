// Which blocks each chunk contained, and which chunks did not arrive. A lost chunk is not repeated with its old
// content: its blocks are sent again with their present values.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace fulcrum::link {

/// Index of a block, the smallest part of a frame or patch that is encoded independently.
using BlockId = std::uint32_t;

/// Sender's record of the chunks.
class SentChunks {
 public:
  /// @param newest number of the last chunk that an earlier sender of this topic sent; 0: none.
  explicit SentChunks(std::uint32_t newest) : newest_(newest) {}
  [[nodiscard]] std::uint32_t newest() const { return newest_; }
  /// Number of the chunk that begins now.
  [[nodiscard]] std::uint32_t Begin() {
    ++newest_;
    Of(newest_).clear();
    return newest_;
  }
  void Tell(BlockId block) { Of(newest_).push_back(block); }
  /// Blocks of a chunk; nullptr if the chunk is too old to be recorded or was not sent yet.
  [[nodiscard]] const std::vector<BlockId>* Find(std::uint32_t chunk) const {
    if (chunk == 0 || chunk > newest_ || newest_ - chunk >= kKept) return nullptr;
    return &ring_[chunk % kKept];
  }

 private:
  /// Chunks kept: more than two seconds of tissue that moves as a whole.
  static constexpr std::uint32_t kKept = 4096;
  std::vector<BlockId>& Of(std::uint32_t chunk) { return ring_[chunk % kKept]; }
  std::vector<std::vector<BlockId>> ring_{kKept};
  std::uint32_t newest_;
};

/// Receiver's record of the chunks.
class MissingChunks {
 public:
  void Note(std::uint32_t chunk) {
    if (newest_ == 0 && chunk > 1) all_ = true;  // The missing chunks before the first received one are not listed.
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
  /// Whether everything must be requested: the receiver is new, or its gaps were too many. Resets the flag.
  [[nodiscard]] bool TakeAll() { return std::exchange(all_, false); }
  void AskForAll() { all_ = true; }
  /// Chunks to request now, at most `most`. Each is requested twice, since the request itself may be lost.
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
