// Offset between the CLOCK_MONOTONIC of another host and that of this host, estimated from round trips.
//
// One round trip: request sent at t1 (our clock), received at t2 and answered at t3 (their clock), answer received at
// t4 (our clock).
//   offset = ((t2 - t1) + (t3 - t4)) / 2   theirs minus ours; the error is at most half the difference of the two ways
//   delay  = (t4 - t1) - (t3 - t2)
// as in NTP (Mills, RFC 5905). The quickest trip of each second is kept. A line through those trips of the last 30 s
// that were about as quick as the quickest one gives offset and drift. Trips that contradict a newer one are dropped:
// the clock of one host stands still while that machine is suspended.
#pragma once

#include <cstdint>
#include <deque>

namespace fulcrum::link {

class ClockFilter {
 public:
  struct Trip {
    std::int64_t t1_ns = 0, t2_ns = 0, t3_ns = 0, t4_ns = 0;
  };
  /// Adds a round trip. An impossible one (answered before it was received, or with a negative delay) is disregarded.
  void Add(const Trip& trip);

  [[nodiscard]] bool known() const { return !best_.empty(); }
  /// Their clock minus ours at the time `now_ns` of our clock [ns]. Changes by at most kLargestSlew, except that an
  /// error of more than kLargestError_ns is corrected at once.
  [[nodiscard]] std::int64_t OffsetAt(std::int64_t now_ns);
  [[nodiscard]] double drift_ppm() const { return 1e6 * drift_; }
  /// Duration of the quickest round trip of the last 30 s [ns].
  [[nodiscard]] std::int64_t delay_ns() const;

  static constexpr double kLargestSlew = 5e-4;
  static constexpr std::int64_t kLargestError_ns = 5'000'000;
  static constexpr double kLargestDrift = 2e-4;  ///< Assumed bound: no quartz drifts more.

 private:
  struct Best {
    std::int64_t time_ns, offset_ns, delay_ns;
  };
  void Fit();

  std::deque<Best> best_;  ///< One per second.
  std::int64_t fit_time_ns_ = 0, fit_offset_ns_ = 0;
  double drift_ = 0;
  std::int64_t result_ns_ = 0, result_time_ns_ = 0;  ///< Last result of OffsetAt and its time; time 0: none yet.
};

}  // namespace fulcrum::link
