// The clock of a running session.
#pragma once

#include <algorithm>
#include <cstdint>

namespace fulcrum::supervisor {

class SessionClock {
 public:
  /// @param start_ns CLOCK_MONOTONIC at session time 0 [ns].
  void Begin(std::int64_t start_ns) { start_ns_ = start_ns; }
  /// Ends the session: its time does not advance after `now_ns`.
  void Stop(std::int64_t now_ns) {
    reached_s_ = std::max(0.0, At(now_ns));
    stopped_ = true;
  }

  /// Session time [s] at a CLOCK_MONOTONIC time; negative before time 0, -1 before Begin.
  [[nodiscard]] double At(std::int64_t now_ns) const {
    if (stopped_) return reached_s_;
    return begun() ? 1e-9 * static_cast<double>(now_ns - start_ns_) : -1.0;
  }
  [[nodiscard]] bool begun() const { return start_ns_ != 0; }
  [[nodiscard]] bool stopped() const { return stopped_; }
  [[nodiscard]] std::int64_t start_ns() const { return start_ns_; }
  /// Session time at Stop [s], never negative; 0 before.
  [[nodiscard]] double reached_s() const { return reached_s_; }

 private:
  std::int64_t start_ns_ = 0;  ///< 0: not begun.
  double reached_s_ = 0;
  bool stopped_ = false;
};

}  // namespace fulcrum::supervisor
