// How far another host's CLOCK_MONOTONIC is from ours, from round trips.
//
// One round trip: sent at t1 (ours), heard at t2 and answered at t3 (theirs), heard at t4 (ours).
//   offset = ((t2 - t1) + (t3 - t4)) / 2   theirs minus ours, off by at most half of
//   delay  = (t4 - t1) - (t3 - t2)         if the two ways differ
// as in NTP (Mills, RFC 5905). Of each second the quickest trip counts; a line through those of the last half minute
// that were about as quick as the quickest gives offset and drift.
#pragma once

#include <cstdint>
#include <deque>

namespace fulcrum::link {

class ClockFilter {
 public:
  struct Trip {
    std::int64_t t1_ns = 0, t2_ns = 0, t3_ns = 0, t4_ns = 0;
  };
  /// One that cannot be (answered before it was heard, a negative delay) is disregarded.
  void Add(const Trip& trip);

  [[nodiscard]] bool known() const { return !best_.empty(); }
  /// Theirs minus ours, at a time of ours [ns]. Changes smoothly: by at most kLargestSlew, but for a correction of more
  /// than kLargestError_ns, which is made at once.
  [[nodiscard]] std::int64_t OffsetAt(std::int64_t now_ns);
  [[nodiscard]] double drift_ppm() const { return 1e6 * drift_; }
  /// Round trip of the quickest in the last half minute [ns].
  [[nodiscard]] std::int64_t delay_ns() const;

  static constexpr double kLargestSlew = 5e-4;
  static constexpr std::int64_t kLargestError_ns = 5'000'000;
  static constexpr double kLargestDrift = 2e-4;  ///< No quartz is worse.

 private:
  struct Best {
    std::int64_t time_ns, offset_ns, delay_ns;
  };
  void Fit();

  std::deque<Best> best_;  ///< One a second.
  std::int64_t fit_time_ns_ = 0, fit_offset_ns_ = 0;
  double drift_ = 0;
  std::int64_t told_ns_ = 0, told_time_ns_ = 0;  ///< What OffsetAt said last, and when; time 0: nothing yet.
};

}  // namespace fulcrum::link
