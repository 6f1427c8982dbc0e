// What a service tells systemd: that it is ready, how it is, that it still advances. Whoever was started by something
// else (no NOTIFY_SOCKET in the environment) tells nobody.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace fulcrum::runtime {

/// Whether a process still does its work, judged by counters of its threads. Pure.
class Progress {
 public:
  /// True when every counter differs from the last time that this returned true, or when there are others to watch.
  [[nodiscard]] bool Advanced(const std::vector<std::uint64_t>& counters);

 private:
  std::vector<std::uint64_t> last_;
};

/// Not thread-safe: one thread speaks for the process.
class ServiceNotify {
 public:
  ServiceNotify();

  /// READY=1.
  void Ready();
  /// Call several times a second. Tells the status when it has changed, at most once a second, and feeds the watchdog
  /// (WatchdogSec= of the unit) while every counter advances: a hung thread ends the process, which is then restarted.
  void Update(std::int64_t now_ns, const std::vector<std::uint64_t>& counters, const std::string& status);
  /// STOPPING=1.
  void Stopping();

 private:
  const bool enabled_;
  std::optional<std::int64_t> beat_period_ns_;  ///< Nothing: no watchdog.
  Progress progress_;
  std::int64_t last_beat_ns_ = 0, last_status_ns_ = 0;
  std::string status_;
};

}  // namespace fulcrum::runtime
