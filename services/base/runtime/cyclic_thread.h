// Runs a callback at a fixed rate on a thread of its own. A late cycle skips whole periods and keeps the phase of the
// clock; it never "catches up" by running twice in a row.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "services/base/core/tick.h"
#include "services/base/runtime/bell.h"
#include "services/base/runtime/histogram.h"

namespace fulcrum::runtime {

struct CyclicThreadSettings {
  std::string name = "cyclic";  ///< Thread name, at most 15 characters.
  std::int64_t period_ns = 10'000'000;
  int fifo_priority = 0;     ///< 0: normal scheduling; otherwise SCHED_FIFO if permitted, with one warning if not.
  std::int64_t spin_ns = 0;  ///< Longest time before a period for which the thread spins instead of sleeping.
  /// While true, nothing depends on the begin of a period to some microseconds: the thread does not spin. Outlives it.
  const std::atomic<bool>* rests = nullptr;
  /// Called on the thread after each period: time until which nothing can happen [CLOCK_MONOTONIC, ns]. The thread
  /// omits the periods that end before it, or until `bell` rings; they count as ticks, since none is late. Null: it
  /// omits none. Given with `bell`, which outlives the thread.
  std::function<std::int64_t()> rests_until = nullptr;
  Bell* bell = nullptr;
  int cpu = -1;  ///< CPU to which the thread is pinned; -1: any.
};

/// Snapshot that another thread may read at any time.
struct CyclicStats {
  std::uint64_t ticks = 0;     ///< Periods run, or omitted at rest.
  std::uint64_t overruns = 0;  ///< Periods skipped.
  HistogramSnapshot wake;      ///< Lateness [ns].
  HistogramSnapshot step;      ///< Duration of the callback [ns].
};

class CyclicThread {
 public:
  /// Called with index, dt_s and stamp_ns set; the callback fills in session_time_s. Must not throw.
  using Callback = std::function<void(const Tick&)>;

  CyclicThread(const CyclicThreadSettings& settings, Callback callback);
  ~CyclicThread();  ///< Stops and joins.
  CyclicThread(const CyclicThread&) = delete;
  CyclicThread& operator=(const CyclicThread&) = delete;

  /// @param grid_ns time grid of the wake-ups: this time plus whole periods (CLOCK_MONOTONIC); 0: begins one period
  /// from now.
  void Start(std::int64_t grid_ns = 0);
  void Stop();
  [[nodiscard]] CyclicStats stats() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Present time of CLOCK_MONOTONIC [ns].
[[nodiscard]] std::int64_t MonotonicNs();

/// The pure sleeping policy, tested on its own: start of the next period after `now` on the grid `phase + k * period`,
/// and the number of whole periods skipped.
struct NextPeriod {
  std::int64_t wake_ns;
  std::uint64_t skipped;
};
[[nodiscard]] NextPeriod PlanNextPeriod(std::int64_t previous_wake_ns, std::int64_t period_ns, std::int64_t now_ns);

/// Time before a period at which a sleep must end so that the thread is late in one of a hundred periods. Pure: follows
/// that quantile of the measured lateness of wake-ups, in small steps, so that a thread spins no longer than its
/// wake-ups need.
class SpinMargin {
 public:
  /// @param longest_ns upper limit, and the value before the first sleep.
  explicit SpinMargin(std::int64_t longest_ns) : longest_ns_(longest_ns), margin_ns_(longest_ns) {}
  /// @param late_ns end of a sleep after the time that was asked for [ns].
  void Add(std::int64_t late_ns);
  [[nodiscard]] std::int64_t value_ns() const { return margin_ns_; }

 private:
  std::int64_t longest_ns_, margin_ns_;
};

}  // namespace fulcrum::runtime
