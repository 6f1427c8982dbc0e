// Notifications of a service to systemd: ready, status, and a watchdog. Without NOTIFY_SOCKET in the environment
// nothing is sent.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace fulcrum::runtime {

/// Whether a process still advances, judged by counters of its threads. Pure.
class Progress {
 public:
  /// True if every counter differs from its value when this last returned true, or if the number of counters has
  /// changed.
  [[nodiscard]] bool Advanced(const std::vector<std::uint64_t>& counters);

 private:
  std::vector<std::uint64_t> last_;
};

/// Not thread-safe: one thread sends the notifications of the process.
class ServiceNotify {
 public:
  ServiceNotify();

  /// Sends READY=1.
  void Ready();
  /// To be called several times a second. Sends the status when it has changed, at most once a second, and the watchdog
  /// notification (WatchdogSec= of the unit) while every counter advances: if a thread hangs, systemd ends and restarts
  /// the process.
  void Update(std::int64_t now_ns, const std::vector<std::uint64_t>& counters, const std::string& status);
  /// Sends STOPPING=1.
  void Stopping();

 private:
  const bool enabled_;
  std::optional<std::int64_t> beat_period_ns_;  ///< Nothing: no watchdog.
  Progress progress_;
  std::int64_t last_beat_ns_ = 0, last_status_ns_ = 0;
  std::string status_;
};

}  // namespace fulcrum::runtime
