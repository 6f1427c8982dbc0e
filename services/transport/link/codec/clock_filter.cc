#include "services/transport/link/codec/clock_filter.h"

#include <algorithm>
#include <cmath>

#include "services/base/core/tick.h"

namespace fulcrum::link {
namespace {

constexpr std::int64_t kMemory_ns = 30 * kSecond_ns;
/// A trip slower than the quickest one by more than this was delayed on one of its ways.
constexpr std::int64_t kHeldUp_ns = 200'000;
/// Over a shorter time the slope of the line is noise and not drift.
constexpr std::int64_t kShortestLine_ns = 8 * kSecond_ns;
constexpr std::size_t kFewestForLine = 5;
/// Two trips whose offsets differ by more than this beyond what their delays and drift allow show that one of the
/// clocks has jumped, as when its machine was suspended.
constexpr double kJump_ns = 1e6;
/// No round trip takes longer: beyond this one of the two clocks has jumped.
constexpr std::int64_t kLongestTrip_ns = 10 * kSecond_ns;

}  // namespace

void ClockFilter::Add(const Trip& trip) {
  // Wrapping arithmetic: the numbers were received and may have any value.
  const auto minus = [](std::int64_t a, std::int64_t b) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
  };
  const std::int64_t there = minus(trip.t4_ns, trip.t1_ns), stay = minus(trip.t3_ns, trip.t2_ns);
  if (there < 0 || there > kLongestTrip_ns || stay < 0 || stay > there) return;
  const std::int64_t delay = there - stay;
  const std::int64_t one = minus(trip.t2_ns, trip.t1_ns), two = minus(trip.t3_ns, trip.t4_ns);
  const std::int64_t offset = one + minus(two, one) / 2;
  const Best now{trip.t4_ns, offset, delay};
  if (!best_.empty() && trip.t4_ns < best_.back().time_ns) return;
  // |error of an offset| <= delay / 2. Trips from before a jump say nothing about the present offset.
  std::erase_if(best_, [&now](const Best& old) {
    const double possible = 0.5 * static_cast<double>(now.delay_ns + old.delay_ns) +
                            kLargestDrift * static_cast<double>(now.time_ns - old.time_ns) + kJump_ns;
    return std::abs(static_cast<double>(now.offset_ns) - static_cast<double>(old.offset_ns)) > possible;
  });
  if (!best_.empty() && trip.t4_ns / kSecond_ns == best_.back().time_ns / kSecond_ns) {
    if (delay < best_.back().delay_ns) best_.back() = now;
  } else {
    best_.push_back(now);
  }
  while (trip.t4_ns - best_.front().time_ns > kMemory_ns) best_.pop_front();
  Fit();
}

void ClockFilter::Fit() {
  const std::int64_t limit = delay_ns() + kHeldUp_ns;
  const Best& origin = best_.back();
  double n = 0, t = 0, x = 0, tt = 0, tx = 0;
  std::int64_t first_ns = origin.time_ns;
  for (const Best& best : best_) {
    if (best.delay_ns > limit) continue;
    const auto time = static_cast<double>(best.time_ns - origin.time_ns);
    const auto offset = static_cast<double>(best.offset_ns - origin.offset_ns);
    first_ns = std::min(first_ns, best.time_ns);
    n += 1;
    t += time;
    x += offset;
    tt += time * time;
    tx += time * offset;
  }
  const double spread = n * tt - t * t;
  const bool line = n >= kFewestForLine && origin.time_ns - first_ns >= kShortestLine_ns && spread > 0;
  drift_ = line ? std::clamp((n * tx - t * x) / spread, -kLargestDrift, kLargestDrift) : 0.0;
  fit_time_ns_ = origin.time_ns + std::llround(t / n);
  fit_offset_ns_ = origin.offset_ns + std::llround(x / n);
}

std::int64_t ClockFilter::OffsetAt(std::int64_t now_ns) {
  if (!known()) return 0;
  const std::int64_t wanted = fit_offset_ns_ + std::llround(drift_ * static_cast<double>(now_ns - fit_time_ns_));
  if (result_time_ns_ == 0 || std::abs(wanted - result_ns_) > kLargestError_ns) {
    result_ns_ = wanted;
  } else {
    const auto room =
        std::llround(kLargestSlew * static_cast<double>(std::max<std::int64_t>(0, now_ns - result_time_ns_)));
    result_ns_ += std::clamp<std::int64_t>(wanted - result_ns_, -room, room);
  }
  result_time_ns_ = now_ns;
  return result_ns_;
}

std::int64_t ClockFilter::delay_ns() const {
  std::int64_t quickest = kLongestTrip_ns;
  for (const Best& best : best_) quickest = std::min(quickest, best.delay_ns);
  return quickest;
}

}  // namespace fulcrum::link
