// How much a recording can still grow.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "services/records/recording/mcap_writer.h"

namespace fulcrum::recorder {

/// Free space of a folder's file system for this user [B]; the largest number if it cannot be determined.
[[nodiscard]] std::uint64_t FreeSpace(const std::filesystem::path& folder);

class Room {
 public:
  /// @param keep_free_B space that stays free on the disk [B].
  Room(const std::filesystem::path& file, std::uint64_t keep_free_B);

  /// Determines how much the file can still grow, and how fast it does.
  void Look(const recording::McapWriter& file, std::int64_t now_ns);

  /// Whether `waiting_B` bytes of samples, and those of the next second, still have room.
  [[nodiscard]] bool Holds(std::uint64_t waiting_B) const;
  /// Time until the room is used up at the present rate [s]; negative: the rate is not known yet.
  [[nodiscard]] double left_s() const;
  /// One line: what is used up, and what to do.
  [[nodiscard]] std::string Reason() const;

 private:
  std::filesystem::path folder_;
  std::uint64_t keep_free_B_;
  std::uint64_t free_B_ = 0, to_limit_B_ = 0, left_B_ = 0;
  double rate_B_per_s_ = -1;  ///< Negative: not known yet.
  std::uint64_t counted_B_ = 0;
  std::int64_t counted_ns_ = 0;
};

}  // namespace fulcrum::recorder
