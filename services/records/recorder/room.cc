#include "services/records/recorder/room.h"

#include <sys/statvfs.h>

#include <algorithm>
#include <limits>

#include "services/base/core/tick.h"

namespace fulcrum::recorder {
namespace {

/// The rate is that of a span of this length: chunks are written every 500 ms.
constexpr std::int64_t kSpan_ns = 2 * kSecond_ns;
/// Samples that do not compress, with their share of the indexes, in units of their size.
constexpr double kGrowth = 1.25;
/// Least rate to expect [B/s]: a scene at rest may begin to move.
constexpr double kLeastRate_B_per_s = 1e6;

std::string Megabytes(std::uint64_t bytes) { return std::to_string(bytes / 1'000'000) + " MB"; }

}  // namespace

std::uint64_t FreeSpace(const std::filesystem::path& folder) {
  struct statvfs space {};
  if (::statvfs(folder.c_str(), &space) != 0) return std::numeric_limits<std::uint64_t>::max();
  return std::uint64_t{space.f_bavail} * space.f_frsize;
}

Room::Room(const std::filesystem::path& file, std::uint64_t keep_free_B)
    : folder_(std::filesystem::absolute(file).parent_path()), keep_free_B_(keep_free_B) {}

void Room::Look(const recording::McapWriter& file, std::int64_t now_ns) {
  free_B_ = FreeSpace(folder_);
  to_limit_B_ = file.BytesToLimit();
  left_B_ = std::min(free_B_ > keep_free_B_ ? free_B_ - keep_free_B_ : 0, to_limit_B_);
  if (counted_ns_ != 0 && now_ns - counted_ns_ < kSpan_ns) return;
  if (counted_ns_ != 0) {
    rate_B_per_s_ =
        static_cast<double>(file.bytes_written() - counted_B_) / (1e-9 * static_cast<double>(now_ns - counted_ns_));
  }
  counted_B_ = file.bytes_written();
  counted_ns_ = now_ns;
}

bool Room::Holds(std::uint64_t waiting_B) const {
  const double needed_B = kGrowth * static_cast<double>(waiting_B) + std::max(rate_B_per_s_, kLeastRate_B_per_s);
  return static_cast<double>(left_B_) >= needed_B;
}

double Room::left_s() const { return rate_B_per_s_ <= 0 ? -1 : static_cast<double>(left_B_) / rate_B_per_s_; }

std::string Room::Reason() const {
  if (left_B_ == to_limit_B_) {
    return "the file has nearly reached the limit of this process on the size of a file (ulimit -f); raise it";
  }
  return Megabytes(free_B_) + " are free on its disk, " + Megabytes(keep_free_B_) +
         " stay free (recorder.keep_free_MB of the cart file); delete old sessions, or record elsewhere (--record-to)";
}

}  // namespace fulcrum::recorder
