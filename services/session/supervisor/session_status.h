// Display of a running session: lines on standard output, the status of the service.
#pragma once

#include <cstdint>
#include <string>

#include "services/base/core/scene_view.h"
#include "services/base/runtime/service_notify.h"
#include "services/session/supervisor/progress.h"
#include "services/session/supervisor/session_record.h"

namespace fulcrum::supervisor {

class SessionStatus {
 public:
  /// @param is_service true: systemd shows the status, and there is no live line on standard output.
  explicit SessionStatus(bool is_service) : progress_(is_service) {}

  /// Prints a permanent line, for example about a restart.
  void Say(const std::string& line) { progress_.Say(line); }
  /// True when a new line is due; check it before building a line.
  [[nodiscard]] bool IsDue(std::int64_t now_ns) const { return progress_.IsDue(now_ns); }
  void Show(std::int64_t now_ns, const std::string& line);

  /// Send READY=1 and STOPPING=1 to systemd.
  void Ready() { service_.Ready(); }
  void Stopping() { service_.Stopping(); }
  /// Call once per turn of the loop: notifies the watchdog and sends the newest line to systemd.
  void Update(std::int64_t now_ns) { service_.Update(now_ns, {++turns_}, line_); }

 private:
  Progress progress_;
  runtime::ServiceNotify service_;
  std::string line_ = "starting";
  std::uint64_t turns_ = 0;
};

/// "t 3.2 / 20.0 s · cut · force 1.20 N · …" of a session that has begun.
/// @param end_s session time of the end [s]; 0: until stopped.
[[nodiscard]] std::string FiguresLine(const std::string& phase, const SessionRecord& record, double session_time_s,
                                      double end_s);

}  // namespace fulcrum::supervisor
